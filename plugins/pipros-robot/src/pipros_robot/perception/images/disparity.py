"""The nodelet `stereo_image_proc/disparity`, which computes disparities between two rectified images."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import SyncInput, inside, synchronized
from pipros_libraries.nodes.params import private
from pipros_libraries.reconfiguring.declared import enum
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import array_of, image_message
from pipros_robot.perception.images.bayer import gray
from pipros_robot.perception.images.matching import (
    SCALE,
    SETTINGS,
    STEREO_BM,
    STEREO_SGBM,
    BlockMatcher,
    corrected,
)
from pipros_robot.perception.images.pinhole import Pinhole
from pipros_robot.perception.images.ports import ERRORS_S, image_input

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image
    from stereo_msgs.msg import DisparityImage

_ALGORITHM = Setting(
    "stereo_algorithm",
    STEREO_BM,
    STEREO_BM,
    STEREO_SGBM,
    "block matching, or semi-global block matching",
    0,
    enum(StereoBM=STEREO_BM, StereoSGBM=STEREO_SGBM),
)
CAMERA_INFO: Final = "sensor_msgs/CameraInfo"


class Disparity(LazyNode):
    """Computes `disparity` from two cameras' images and calibrations, while `disparity` has subscribers."""

    def __init__(self, node: Node) -> None:
        self._cv2 = opencv("stereo matching")
        self._errors = Throttle(node.log, ERRORS_S)
        self._factor = max(private(node, "downsampling_factor", 1), 1)
        self._message: type[DisparityImage] = load_message_class("stereo_msgs/DisparityImage")
        self._output = node.advertise("disparity", self._message, queue_size=1)
        self._matcher: BlockMatcher
        self._settings = Reconfigurable(node, "~", [_ALGORITHM, *SETTINGS], self._apply)
        queue_size, is_exact = (
            private(node, "queue_size", 5),
            not private(node, "approximate_sync", False),
        )
        inputs = [
            image_input(inside(node, "left", "image_rect")),
            SyncInput(inside(node, "left", "camera_info"), CAMERA_INFO),
            image_input(inside(node, "right", "image_rect")),
            SyncInput(inside(node, "right", "camera_info"), CAMERA_INFO),
        ]
        self._inputs = LazyInputs(
            [self._output],
            lambda: synchronized(
                node, inputs, self._on_images, queue_size, is_exact=is_exact, topic_queue_size=1
            ),
        )

    def _apply(self, values: Mapping[str, Value], _level: int) -> Mapping[str, Value]:
        accepted = corrected(values)
        self._matcher = BlockMatcher(accepted)
        return accepted

    def _on_images(self, left: Image, left_info: CameraInfo, right: Image, right_info: CameraInfo) -> None:
        matcher = self._matcher
        try:
            left_camera, right_camera = Pinhole.of(left_info), Pinhole.of(right_info)
            images = [gray(array_of(each), each.encoding) for each in (left, right)]
            pixels = [
                array if name == "mono8" else (array // 257).astype("uint8")  # 65535 becomes 255
                for array, name in images
            ]
            found = matcher.disparities(pixels[0], pixels[1], self._factor)
        except (PiprosError, self._cv2.error) as error:
            self._errors.error("cannot compute disparities: %s", error)
            return
        offset = left_camera.cx - right_camera.cx
        if offset:
            found -= offset
        height, width = found.shape
        result = self._message()
        result.header = copy.copy(left_info.header)
        result.header.frame_id = left.header.frame_id
        result.image = image_message(found, "32FC1", result.header)
        result.f, result.T = right_camera.fx, -right_camera.tx / right_camera.fx
        low = matcher.values["min_disparity"]
        result.min_disparity = float(low)
        result.max_disparity = float(low + matcher.values["disparity_range"] - 1)
        result.delta_d = 1.0 / SCALE
        window = result.valid_window
        window.x_offset, window.y_offset, window.width, window.height = (
            max(each, 0) for each in matcher.valid_window(width, height)
        )
        self._output.publish(result)
