"""The nodelet `image_proc/rectify`, which removes the lens distortion of images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros_libraries.nodes.inputs import synchronized
from pipros_libraries.nodes.params import private
from pipros_libraries.reconfiguring.declared import enum
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import array_of, image_message
from pipros_robot.perception.images.pinhole import Rectifier, key_of
from pipros_robot.perception.images.ports import ImageOutput, camera

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image

INTERPOLATIONS = enum(NN=0, Linear=1, Cubic=2, Lanczos4=4)
"""OpenCV's interpolation constants."""

_SETTING = Setting("interpolation", 1, 0, 4, "how values between pixels are computed", 0, INTERPOLATIONS)


class Rectify(LazyNode):
    """Rectifies `image_mono` according to `camera_info`, while `image_rect` has subscribers."""

    def __init__(self, node: Node) -> None:
        self._cv2 = opencv("rectifying images")
        self._errors = Throttle(node.log, 30.0)
        self._suffix = private(node, "rectified_frame_suffix", "")
        self._rectifier: Rectifier | None = None
        queue_size = private(node, "queue_size", 5)
        self._output = ImageOutput(node, "image_rect")
        self._settings = Reconfigurable(node, "~", [_SETTING], self._apply)
        self._inputs = LazyInputs(
            self._output.publishers,
            lambda: synchronized(node, camera(node, "image_mono"), self._on_image, queue_size),
        )

    def _apply(self, values: Mapping[str, Value], level: int) -> None:
        """Do nothing, because each image is rectified with the current values."""

    def _on_image(self, message: Image, info: CameraInfo) -> None:
        try:
            if self._rectifier is None or self._rectifier.key != key_of(info):
                self._rectifier = Rectifier(info)
            if not self._rectifier.is_needed:
                self._output.publish(message)
                return
            interpolation = int(self._settings.values["interpolation"])
            rectified = self._rectifier.rectified(array_of(message), interpolation)
        except (PiprosError, self._cv2.error) as error:
            self._errors.error("cannot rectify the image: %s", error)
            return
        result = image_message(rectified, message.encoding, message.header)
        result.header.frame_id += self._suffix
        self._output.publish(result)
