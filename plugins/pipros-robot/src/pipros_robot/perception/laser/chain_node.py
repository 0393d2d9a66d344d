"""The nodes `scan_to_scan_filter_chain` and `scan_to_cloud_filter_chain`, which can also run as nodelets."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.nodes.params import private, private_ns, raw
from pipros_libraries.reconfiguring.server import Reconfigurable
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformGate, TransformListener
from pipros_robot.perception.clouds.points import cloud_of
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import FilterFailed, FilterHost, InvalidFilter, ScanFilter
from pipros_robot.perception.laser.filters.chain import FilterChain, chain_of
from pipros_robot.perception.laser.filters.shapes import PolygonFilter
from pipros_robot.perception.laser.projection import channels, moving, poses_of_scan, projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from geometry_msgs.msg import Point32, PolygonStamped
    from sensor_msgs.msg import LaserScan, PointCloud2
    from std_msgs.msg import Header

QUEUE_SIZE: Final = 50


class ScanChain:
    """The filter chain described by a node's private parameter, with its settings and transforms."""

    def __init__(self, node: Node, names: Sequence[str], listener: TransformListener | None = None) -> None:
        """Create the filters, and offer their settings.

        If the chain is invalid, log an error. `update` then always raises FilterFailed.

        Args:
            names: the parameter's name, and its deprecated names.
        """
        self.node, self._lock = node, threading.Lock()
        found = [(name, raw(node, name)) for name in names]
        name, description = next(((name, value) for name, value in found if value is not None), found[0])
        if name != names[0]:
            node.log.warning("the parameter ~%s is deprecated; use ~%s", name, names[0])
        self._listener: TransformListener | None = listener
        self._chain: FilterChain | None = None
        try:
            self._chain = chain_of(description, _LazyPlace(self._listen), name)
        except InvalidFilter as error:
            node.log.error("%s", error)
            return
        for each in self._chain.filters:
            if isinstance(each, PolygonFilter):
                _show_polygon(node, each)
            if each.is_reconfigurable:
                self._offer(each)

    def _listen(self) -> TransformListener:
        if self._listener is None:
            self._listener = TransformListener(self.node)
        return self._listener

    def _offer(self, one: ScanFilter) -> None:
        """Offer a filter's settings.

        Values in the chain's description take precedence over parameters on the server, except for the
        settings in `from_server`.
        """
        given, is_ready = one.values, False

        def apply(values: Mapping[str, Any], _: int) -> None:
            if is_ready:
                with self._lock:
                    one.values = {**one.values, **values}
                    one.changed()

        server = Reconfigurable(self.node, f"~{one.name}", one.settings, apply)
        one.values = {**given, **{name: server.values[name] for name in one.from_server}}
        for name in one.from_server:
            if given[name] != one.values[name]:
                self.node.log.warning(
                    "filter %s: %s in the chain has no effect, as in laser_filters 1.9; set ~%s/%s",
                    *(one.name, name, one.name, name),
                )
        server.update(given)
        is_ready = True

    def update(self, message: LaserScan) -> Scan:
        """Return the filtered scan.

        Raises:
            FilterFailed: a filter cannot process the scan, or the chain is invalid.
        """
        if self._chain is None:
            raise FilterFailed("the filter chain is invalid")
        with self._lock:
            return self._chain.update(Scan.of(message))


class _LazyPlace(FilterHost):
    """Subscribes to transforms when a filter first needs them."""

    def __init__(self, listen: Callable[[], TransformListener]) -> None:
        super().__init__()
        self._listen = listen

    @property
    def listener(self) -> TransformListener:
        return self._listen()


def _show_polygon(node: Node, one: PolygonFilter) -> None:
    """Publish a filter's polygon on a latched topic."""
    polygon: PolygonStamped = load_message_class("geometry_msgs/PolygonStamped")()
    point: type[Point32] = load_message_class("geometry_msgs/Point32")
    polygon.header.frame_id = one.values["polygon_frame"]
    polygon.header.stamp = stamp(node.clock)
    polygon.polygon.points = [point(float(x), float(y), 0.0) for x, y in one.polygon]
    node.advertise(f"~{one.name}/polygon", type(polygon), latch=True, queue_size=1).publish(polygon)


class ScanToScanFilterChain:
    """Filters `scan`, and publishes the result as `scan_filtered`."""

    def __init__(self, node: Node) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        scan_class: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        self._errors = Throttle(node.log, 1.0)
        target = private(node, "tf_message_filter_target_frame", "")
        self._listener = TransformListener(node) if target else None
        self._chain = ScanChain(node, ("scan_filter_chain", "filter_chain"), self._listener)
        self._output = node.advertise("scan_filtered", scan_class, queue_size=1000)
        receive: Callable[[Any], object] = self._on_scan
        if self._listener is not None:
            tolerance_ns = private_ns(node, "tf_message_filter_tolerance", 0.03)
            gate = TransformGate(self._listener, target, QUEUE_SIZE, self._on_scan, tolerance_ns=tolerance_ns)
            receive = gate.add
        self._input = node.subscribe("scan", scan_class, receive, queue_size=QUEUE_SIZE)

    def _on_scan(self, message: LaserScan) -> None:
        try:
            self._output.publish(self._chain.update(message).message())
        except FilterFailed as error:
            self._errors.error("Filtering the scan from time %s failed: %s", message.header.stamp, error)


class ScanToCloudFilterChain:
    """Filters `scan`, and converts it to `cloud_filtered` in `~target_frame`."""

    def __init__(self, node: Node) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        self._errors = Throttle(node.log, 1.0)
        self._target = private(node, "target_frame", "")
        if not self._target:
            node.log.warning("~target_frame is not set: clouds are in base_link")
            self._target = "base_link"
        self._corrects = private(node, "incident_angle_correction", True)
        self._cutoff = private(node, "laser_max_range", float(np.finfo(np.float64).max))
        self._channels = {
            "intensity": private(node, "cloud_channel_intensity", True),
            "index": private(node, "cloud_channel_index", True),
            "distances": private(node, "cloud_channel_distance", True),
            "stamps": private(node, "cloud_channel_timestamp", True),
        }
        self._has_viewpoint = private(node, "cloud_channel_viewpoint", False)
        if raw(node, "cloud_filter_chain"):
            node.log.error("~cloud_filter_chain is ignored, because filters for clouds are not supported")
        self._listener = TransformListener(node)
        names = ("scan_filter_chain", "scan_filter_chain/filter_chain")
        self._chain = ScanChain(node, names, self._listener)
        cloud_class: type[PointCloud2] = load_message_class("sensor_msgs/PointCloud2")
        self._output = node.advertise("cloud_filtered", cloud_class, queue_size=10)
        tolerance_ns = private_ns(node, "notifier_tolerance", 0.03)
        self._gate = TransformGate(
            self._listener, self._target, QUEUE_SIZE, self._on_scan, tolerance_ns=tolerance_ns
        )
        scan_class: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        self._input = node.subscribe("scan", scan_class, self._gate.add, queue_size=QUEUE_SIZE)

    def _on_scan(self, message: LaserScan) -> None:
        try:
            scan = self._chain.update(message)
        except FilterFailed as error:  # as in laser_filters, convert the unfiltered scan
            self._errors.error("Filtering the scan failed: %s", error)
            scan = Scan.of(message)
        with np.errstate(all="ignore"):  # angles and times of a scan may be infinite
            self._convert(scan, message.header)

    def _convert(self, scan: Scan, scan_header: Header) -> None:
        if self._corrects:
            scan = scan.with_ranges(scan.ranges + 0.03 * np.exp(-np.abs(np.sin(scan.angles32()))))
        try:
            poses = poses_of_scan(self._listener, self._target, scan)
        except TransformException as error:
            self._errors.warning("cannot convert a scan to a cloud: %s", error)
            return
        beams = valid_beams(scan, self._cutoff)
        points = moving(projected(scan, beams), beams, len(scan.ranges), poses)
        header: Header = load_message_class("std_msgs/Header")(frame_id=self._target)
        header.stamp = scan_header.stamp
        fields = {**dict(zip("xyz", points.T, strict=True)), **channels(scan, beams, self._channels)}
        if self._has_viewpoint:
            scanner = moving(np.zeros_like(points), beams, len(scan.ranges), poses)
            fields |= dict(zip(("vp_x", "vp_y", "vp_z"), scanner.T, strict=True))
        self._output.publish(cloud_of(header, fields))
