"""The nodelet `stereo_image_proc/point_cloud2`, which converts disparities to coloured points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import SyncInput, inside, synchronized
from pipros_libraries.nodes.params import private
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import BadImage, array_of
from pipros_robot.perception.images.clouds import cloud_message, empty_points, set_colors
from pipros_robot.perception.images.disparity import CAMERA_INFO
from pipros_robot.perception.images.pinhole import Pinhole
from pipros_robot.perception.images.ports import ERRORS_S, image_input

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image
    from stereo_msgs.msg import DisparityImage

    from pipros_libraries.vision.extras import Array

_COLORS = ("mono8", "rgb8", "rgba8", "bgr8", "bgra8")
_MISSING_Z = 10000.0
"""Depth that OpenCV assigns to pixels with the smallest disparity, which have no match."""


class StereoCloud(LazyNode):
    """Combines `disparity` and the left image into `points2`, while `points2` has subscribers."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, ERRORS_S)
        self._output = node.advertise("points2", load_message_class("sensor_msgs/PointCloud2"), queue_size=1)
        queue_size = private(node, "queue_size", 5)
        is_exact = not private(node, "approximate_sync", False)
        inputs = [
            image_input(inside(node, "left", "image_rect_color")),
            SyncInput(inside(node, "left", "camera_info"), CAMERA_INFO),
            SyncInput(inside(node, "right", "camera_info"), CAMERA_INFO),
            SyncInput("disparity", "stereo_msgs/DisparityImage"),
        ]
        self._inputs = LazyInputs(
            [self._output],
            lambda: synchronized(
                node, inputs, self._on_messages, queue_size, is_exact=is_exact, topic_queue_size=1
            ),
        )

    def _on_messages(
        self, image: Image, left_info: CameraInfo, right_info: CameraInfo, disparity: DisparityImage
    ) -> None:
        try:
            if disparity.image.encoding != "32FC1":
                raise BadImage(f"disparities must be 32FC1, got [{printable(disparity.image.encoding)}]")
            disparities = array_of(disparity.image)
            xyz = positions(disparities, Pinhole.of(left_info), Pinhole.of(right_info))
            points = empty_points(*disparities.shape, has_colors=True)
            points[:, :, :3] = xyz
        except PiprosError as error:
            self._errors.error("cannot compute points: %s", error)
            return
        try:
            if image.encoding not in _COLORS:
                raise BadImage(f"the encoding [{printable(image.encoding)}] is not supported")
            pixels = array_of(image)
            if pixels.shape[:2] != disparities.shape:
                raise BadImage(
                    f"the image must have the shape of the disparities {disparities.shape}, "
                    f"got {pixels.shape[:2]}"
                )
            set_colors(points, pixels, image.encoding, alpha=0)
        except PiprosError as error:
            self._errors.error("the points have no colours: %s", error)
        self._output.publish(cloud_message(points, disparity.header))


def positions(disparities: Array, left: Pinhole, right: Pinhole) -> Array:
    """Return the points of a disparity image in metres; NaN for pixels with the smallest disparity.

    Raises:
        BadImage: the cameras have no baseline.
    """
    baseline = -right.tx / right.fx
    if not baseline:
        raise BadImage("the cameras have no baseline: P[3] of the right camera is 0")
    q = np.zeros((4, 4))
    q[0] = left.fy * -baseline, 0, 0, -left.fy * left.cx * -baseline
    q[1] = 0, left.fx * -baseline, 0, -left.fx * left.cy * -baseline
    q[2, 3] = left.fx * left.fy * -baseline
    q[3, 2] = -left.fy  # the disparities already contain the difference of the principal points
    found: Array = opencv("stereo matching").reprojectImageTo3D(disparities, q, handleMissingValues=True)
    depth = found[:, :, 2]
    found[(depth == _MISSING_Z) | ~np.isfinite(depth)] = np.nan
    return found
