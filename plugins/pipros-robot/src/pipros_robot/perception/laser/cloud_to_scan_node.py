"""The program `pointcloud_to_laserscan_node`, and the nodelet of the same package."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.params import private
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformGate, TransformListener
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.perception.clouds.points import InvalidCloud, matrix_of, moved, positions, rows_of
from pipros_robot.perception.laser.cloud_to_scan import CloudToScan, InvalidScanSettings

if TYPE_CHECKING:
    from sensor_msgs.msg import LaserScan, PointCloud2


class CloudToScanNode(LazyNode):
    """Converts `cloud_in` to `scan`, while `scan` has subscribers."""

    def __init__(self, node: Node) -> None:
        """Advertise `scan`. Blocks until the master answers."""
        self._node, self._warnings = node, Throttle(node.log, 1.0)
        self._scan_class: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        usual: dict[str, Any] = {each.name: each.default for each in dataclasses.fields(CloudToScan)}
        self._settings = CloudToScan(
            **{name: private(node, name, default) for name, default in usual.items()}
        )
        self._target = private(node, "target_frame", "")
        self._tolerance_s = private(node, "transform_tolerance", 0.01)
        level = private(node, "concurrency_level", 1)
        self._queue_size = level if level > 0 else os.cpu_count() or 1
        self._listener: TransformListener | None = None
        self._receive: Callable[[Any], object] = self._on_cloud
        if self._target:
            self._listener = TransformListener(node)
            gate = TransformGate(
                self._listener, self._target, self._queue_size, self._on_cloud, self._on_dropped
            )
            self._receive = gate.add
        self._output = node.advertise("scan", self._scan_class, queue_size=10)
        self._inputs = LazyInputs([self._output], self._subscribe)

    def _subscribe(self) -> list[Any]:
        cloud_class: type[PointCloud2] = load_message_class("sensor_msgs/PointCloud2")
        return [
            self._node.subscribe(
                "cloud_in", cloud_class, self._receive, queue_size=self._queue_size, zero_copy=True
            )
        ]

    def _on_dropped(self, cloud: PointCloud2) -> None:
        self._warnings.warning(
            "can't transform a cloud from frame %s to %s at time %.3f",
            cloud.header.frame_id,
            self._target,
            in_ns(cloud.header.stamp) / 1e9,
        )

    def _on_cloud(self, cloud: PointCloud2) -> None:
        one, source = self._settings, cloud.header.frame_id
        try:
            points = positions(cloud, rows_of(cloud))
            if self._listener is not None and self._target != source:
                pose = self._listener.at(
                    self._target, source.removeprefix("/"), in_ns(cloud.header.stamp), self._tolerance_s
                )
                points = moved(points, matrix_of(pose))
            ranges = one.ranges(points)
        except (InvalidCloud, InvalidScanSettings, TransformException) as error:
            self._warnings.error("cannot convert a cloud to a scan: %s", error)
            return
        scan = self._scan_class(
            angle_min=one.angle_min,
            angle_max=one.angle_max,
            angle_increment=one.angle_increment,
            scan_time=one.scan_time,
            range_min=one.range_min,
            range_max=_in_float32(one.range_max),
            ranges=ranges,
        )
        scan.header.stamp, scan.header.frame_id = cloud.header.stamp, self._target or source
        self._output.publish(scan)


def _in_float32(value: float) -> float:
    """Replace a number that is too large for float32 with infinity, as C++ does."""
    return value if abs(value) < 3.402823466e38 else float("inf") * (1 if value > 0 else -1)
