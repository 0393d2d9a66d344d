"""The nodelet `image_proc/debayer`, which converts a camera's raw images to grey and colour images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros_libraries.reconfiguring.declared import enum
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_robot.perception.images.arrays import array_of, image_message
from pipros_robot.perception.images.bayer import BILINEAR, EDGE_AWARE, EDGE_AWARE_WEIGHTED, VNG, colors, gray
from pipros_robot.perception.images.ports import ERRORS_S, ImageOutput, subscribe_image

if TYPE_CHECKING:
    from sensor_msgs.msg import Image

_METHODS = enum(Bilinear=BILINEAR, EdgeAware=EDGE_AWARE, EdgeAwareWeighted=EDGE_AWARE_WEIGHTED, VNG=VNG)
_SETTING = Setting("debayer", BILINEAR, BILINEAR, VNG, "how colours are interpolated", 0, _METHODS)


class Debayer(LazyNode):
    """Converts `image_raw` to `image_mono` and `image_color`, while the respective topic has subscribers."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, ERRORS_S)
        self._mono = ImageOutput(node, "image_mono")
        self._color = ImageOutput(node, "image_color")
        self._settings = Reconfigurable(node, "~", [_SETTING], self._apply)
        self._inputs = LazyInputs(
            [*self._mono.publishers, *self._color.publishers],
            lambda: [subscribe_image(node, "image_raw", self._on_image, queue_size=1)],
        )

    def _apply(self, values: Mapping[str, Value], level: int) -> None:
        """Do nothing, because each image is converted with the current values."""

    def _on_image(self, message: Image) -> None:
        for output, is_color in ((self._mono, False), (self._color, True)):
            if not output.is_wanted:
                continue
            try:
                array = array_of(message)
                method = int(self._settings.values["debayer"])
                converted, name = (
                    colors(array, message.encoding, method) if is_color else gray(array, message.encoding)
                )
            except PiprosError as error:
                self._errors.error("cannot convert the raw image: %s", error)
                continue
            if converted is array:
                if is_color and name.startswith("mono"):
                    self._errors.warning("image_color has subscribers, but the raw image is grey")
                output.publish(message)
            else:
                output.publish(image_message(converted, name, message.header))
