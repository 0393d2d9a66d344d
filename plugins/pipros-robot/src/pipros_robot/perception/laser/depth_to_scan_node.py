"""The node `depthimage_to_laserscan`, and `depthimage_to_laserscan/DepthImageToLaserScanNodelet`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import synchronized
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_robot.perception.images.ports import camera
from pipros_robot.perception.laser.depth_to_scan import DepthToScan, InvalidDepthImage, view_of

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image, LaserScan

QUEUE_SIZE: Final = 10
SETTINGS: Final = (
    Setting("scan_height", 1, 1, 500, "Height of the laser band in pixels."),
    Setting("scan_time", 0.033, 0.0, 1.0, "Time between scans in seconds."),
    Setting("range_min", 0.45, 0.0, 10.0, "Minimum distance in metres."),
    Setting("range_max", 10.0, 0.0, 10.0, "Maximum distance in metres."),
    Setting("output_frame_id", "camera_depth_frame", description="Frame of the scans."),
)


class DepthToScanNode(LazyNode):
    """Converts `image`, described by `camera_info`, to `scan`, while `scan` has subscribers."""

    def __init__(self, node: Node) -> None:
        """Advertise `scan`, and serve the settings. Blocks until the master answers."""
        self._node, self._warnings = node, Throttle(node.log, 1.0)
        self._scan_class: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        self._settings: Mapping[str, Any] = {}
        self._server = Reconfigurable(node, "~", SETTINGS, self._configure)
        self._output = node.advertise("scan", self._scan_class, queue_size=QUEUE_SIZE)
        self._inputs = LazyInputs([self._output], self._subscribe)

    def _configure(self, values: Mapping[str, Value], _: int) -> None:
        self._settings = values

    def _subscribe(self) -> list[Any]:
        return synchronized(self._node, camera(self._node, "image"), self._on_image, QUEUE_SIZE)

    def _on_image(self, image: Image, info: CameraInfo) -> None:
        given = self._settings
        one = DepthToScan(given["scan_height"], given["range_min"], given["range_max"])
        try:
            view = view_of(info, image.width)
            ranges = one.ranges(image, view)
        except InvalidDepthImage as error:
            self._warnings.error("Could not convert depth image to laserscan: %s", error)
            return
        scan = self._scan_class(
            angle_min=view.angle_min,
            angle_max=view.angle_max,
            angle_increment=float(view.increment(image.width)),
            scan_time=given["scan_time"],
            range_min=one.range_min,
            range_max=one.range_max,
            ranges=ranges,
        )
        scan.header.stamp = image.header.stamp
        scan.header.frame_id = given["output_frame_id"] or image.header.frame_id
        self._output.publish(scan)
