"""The program `laser_scan_assembler`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros_libraries.nodes.params import private, private_ns
from pipros_libraries.nodes.program import run_node
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformGate, TransformListener
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.perception.clouds.points import cloud_of
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.assembler import Assembler, StoredScan
from pipros_robot.perception.laser.chain_node import ScanChain
from pipros_robot.perception.laser.filters.base import FilterFailed
from pipros_robot.perception.laser.projection import channels, moving, poses_of_scan, projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from geometry_msgs.msg import Point32
    from sensor_msgs.msg import ChannelFloat32, LaserScan, PointCloud, PointCloud2
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array

    Convert = Callable[[Header, StoredScan | None], PointCloud | PointCloud2]

QUEUE_SIZE: Final = 10
SCANS: Final = 400
_CHANNELS: Final = {"intensity": "intensities"}
"""Channel names of a `sensor_msgs/PointCloud` that differ from the field names."""


class LaserScanAssembler:
    """Stores the points of scans in `~fixed_frame`. Its services return the points of a time interval."""

    def __init__(self, node: Node) -> None:
        """Subscribe, and offer the services. Blocks until the master answers."""
        self._warnings, self._lock = Throttle(node.log, 1.0), threading.Lock()
        self._frame = private(node, "fixed_frame", "")
        if not self._frame:
            node.log.error("~fixed_frame must be set to the frame of the assembled clouds")
        size = private(node, "max_scans", SCANS)
        if size < 0:
            node.log.error("~max_scans must be >= 0, got %d: using %d", size, SCANS)
        self._assembler = Assembler(size if size >= 0 else SCANS, private(node, "downsample_factor", 1))
        self._ignores_motion = private(node, "ignore_laser_skew", True)
        self._length_ns = max(private_ns(node, "tf_cache_time_secs", 10.0), 0)
        self._listener = TransformListener(node, self._length_ns)
        self._chain = ScanChain(node, ("filters",), self._listener)
        for name in ("build_cloud", "assemble_scans"):
            self._serve(node, name, "laser_assembler/AssembleScans", self._point_cloud)
        for name in ("build_cloud2", "assemble_scans2"):
            self._serve(node, name, "laser_assembler/AssembleScans2", self._point_cloud_2)
        self._gate = TransformGate(self._listener, self._frame, QUEUE_SIZE, self._on_scan)
        scan_class: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        node.subscribe("scan", scan_class, self._receive, queue_size=QUEUE_SIZE)

    def _receive(self, message: LaserScan) -> None:
        if not self._ignores_motion:
            duration_ns = message.time_increment * len(message.ranges) * NS_PER_S
            if abs(duration_ns) < self._length_ns:  # a longer one would hold back all scans after it
                self._gate.tolerance_ns = max(self._gate.tolerance_ns, round(duration_ns))
        self._gate.add(message)

    def _on_scan(self, message: LaserScan) -> None:
        try:
            scan = self._chain.update(message)
            poses = poses_of_scan(self._listener, self._frame, scan, moves=not self._ignores_motion)
        except (FilterFailed, TransformException) as error:
            self._warnings.warning("cannot store a scan: %s", error)
            return
        beams = valid_beams(scan)
        with np.errstate(all="ignore"):  # angles and times of a scan may be infinite
            points = moving(projected(scan, beams), beams, len(scan.ranges), poses)
            columns = self._columns(scan, beams, points)
        with self._lock:
            self._assembler.add(StoredScan(scan.stamp_ns, columns))

    def _columns(self, scan: Scan, beams: Array, points: Array) -> dict[str, Array]:
        names = {"intensity": True, "index": True}
        if not self._ignores_motion:
            names |= {"distances": True, "stamps": True}
        found = {_CHANNELS.get(name, name): each for name, each in channels(scan, beams, names).items()}
        return {**dict(zip("xyz", points.T, strict=True)), **found}

    def _serve(self, node: Node, name: str, type_name: str, cloud: Convert) -> None:
        service_class: Any = load_service_class(type_name)

        def respond(request: Any) -> Any:
            header: Header = load_message_class("std_msgs/Header")(frame_id=self._frame, stamp=request.end)
            with self._lock:
                found = self._assembler.assembled(in_ns(request.begin), in_ns(request.end))
            if found is not None:
                header.stamp = Time(*divmod(found.stamp_ns, NS_PER_S))
            return service_class._response_class(cloud(header, found))

        node.serve(name, service_class, respond)

    def _point_cloud(self, header: Header, found: StoredScan | None) -> PointCloud:
        cloud: PointCloud = load_message_class("sensor_msgs/PointCloud")(header=header)
        point: type[Point32] = load_message_class("geometry_msgs/Point32")
        channel: type[ChannelFloat32] = load_message_class("sensor_msgs/ChannelFloat32")
        if found is not None:
            columns = dict(found.columns)
            x, y, z = (columns.pop(axis).tolist() for axis in "xyz")
            cloud.points = list(map(point, x, y, z))
            cloud.channels = [channel(name, values) for name, values in columns.items()]
        return cloud

    def _point_cloud_2(self, header: Header, found: StoredScan | None) -> PointCloud2:
        empty = dict.fromkeys("xyz", np.zeros(0, np.float32))
        columns = empty if found is None else found.columns
        return cloud_of(header, {name: each.astype(np.float32) for name, each in columns.items()})


def main(argv: Sequence[str] | None = None) -> int:
    """Run `laser_scan_assembler` until the node is shut down."""
    return run_node(
        "laser_scan_assembler", "laser_assembler", lambda node, *_: LaserScanAssembler(node), argv
    )
