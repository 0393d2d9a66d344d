"""Image topics of nodelets: inputs with any transport, and compressed outputs."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import SyncInput
from pipros_libraries.nodes.params import private
from pipros_libraries.pictures.codecs import codec
from pipros_libraries.vision.compressed_images import (
    CompressionError,
    compressed_by,
    decompressed,
    read_settings,
)
from pipros_robot.perception.images.arrays import BadImage, array_of, image_message

if TYPE_CHECKING:
    from sensor_msgs.msg import CompressedImage, Image

ERRORS_S: Final = 10.0
"""Minimum interval between log messages about the same error."""


class ImageOutput:
    """An image topic with its transport `compressed`, or `compressedDepth` for depth images.

    Attributes:
        publishers: the publishers of raw and of compressed images.
    """

    def __init__(self, node: Node, topic: str, *, is_depth: bool = False) -> None:
        self._node = node
        self._base = node.resolve(topic)
        self._raw = node.advertise(self._base, load_message_class("sensor_msgs/Image"), queue_size=1)
        self._transport = "compressedDepth" if is_depth else "compressed"
        self._message: type[CompressedImage] = load_message_class("sensor_msgs/CompressedImage")
        self._compressed = node.advertise(f"{self._base}/{self._transport}", self._message, queue_size=1)
        self._errors = Throttle(node.log, ERRORS_S)
        self.publishers = self._raw, self._compressed

    @property
    def is_wanted(self) -> bool:
        """Whether raw or compressed images have subscribers."""
        return any(each.connection_count for each in self.publishers)

    def publish(self, image: Image) -> None:
        """Publish a `sensor_msgs/Image`. Compress it only if the compressed topic has subscribers."""
        if self._raw.connection_count:
            self._raw.publish(image)
        if self._compressed.connection_count:
            try:
                self._compressed.publish(self._message(image.header, *self._compress(image)))
            except (CompressionError, BadImage, ImportError) as error:
                self._errors.error("cannot compress images of %s: %s", self._base, error)

    def _compress(self, image: Image) -> tuple[str, bytes]:
        settings = read_settings(self._transport, self._setting)
        return compressed_by(settings, array_of(image), image.encoding, codec())

    def _setting(self, name: str, default: Any) -> Any:
        with contextlib.suppress(LookupError, PiprosError):
            return self._node.params.get_cached(f"{self._base}/{self._transport}/{name}")
        return default


def subscribe_image(
    node: Node, topic: str, callback: Callable[[Any], object], queue_size: int, transport: str | None = None
) -> Any:
    """Subscribe to an image topic. `transport` defaults to the parameter `~image_transport`."""
    transport = transport or private(node, "image_transport", "raw")
    if transport == "raw":
        kind = load_message_class("sensor_msgs/Image")
        return node.subscribe(topic, kind, callback, queue_size=queue_size, zero_copy=True)
    errors = Throttle(node.log, ERRORS_S)

    def decompress(message: CompressedImage) -> None:
        try:
            array, encoding = decompressed(message.format, message.data, codec())
        except (CompressionError, ImportError) as error:
            errors.error("cannot decompress images of %s: %s", topic, error)
            return
        callback(image_message(array, encoding, message.header))

    return node.subscribe(
        f"{node.resolve(topic)}/{transport}",
        load_message_class("sensor_msgs/CompressedImage"),
        decompress,
        queue_size=queue_size,
    )


def image_input(topic: str, transport: str | None = None) -> SyncInput:
    """Return a synchronized input for an image topic. See `subscribe_image` for `transport`."""
    return SyncInput(topic, "sensor_msgs/Image", partial(subscribe_image, transport=transport))


def camera(node: Node, topic: str) -> tuple[SyncInput, SyncInput]:
    """Return the inputs for an image topic and the `camera_info` in the same namespace."""
    info = names.namespace(node.resolve(topic)) + "camera_info"
    return image_input(topic), SyncInput(info, "sensor_msgs/CameraInfo")
