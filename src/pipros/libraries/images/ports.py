"""Image topics of nodelets: inputs with any transport, synchronized inputs, and compressed outputs."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.libraries.filters.synchronizer import ApproximateSynchronizer, ExactSynchronizer
from pipros.libraries.images.arrays import BadImage, array_of, image_message
from pipros.libraries.vision.compressed_images import (
    CompressionError,
    compressed_by,
    decompressed,
    read_settings,
)
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.private_params import private
from pipros.pictures.codecs import codec

ERRORS_S: Final = 10.0
"""Minimum interval between log messages about the same error."""

APPROXIMATE_S: Final = 0.1
"""Maximum difference between the timestamps of matching messages, if they need not be equal."""


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
        self._message: Any = load_message_class("sensor_msgs/CompressedImage")
        self._compressed = node.advertise(f"{self._base}/{self._transport}", self._message, queue_size=1)
        self._errors = Throttle(node.log, ERRORS_S)
        self.publishers = self._raw, self._compressed

    @property
    def is_wanted(self) -> bool:
        """Whether raw or compressed images have subscribers."""
        return any(each.connection_count for each in self.publishers)

    def publish(self, image: Any) -> None:
        """Publish a `sensor_msgs/Image`. Compress it only if the compressed topic has subscribers."""
        if self._raw.connection_count:
            self._raw.publish(image)
        if self._compressed.connection_count:
            try:
                self._compressed.publish(self._message(image.header, *self._compress(image)))
            except (CompressionError, BadImage, ImportError) as error:
                self._errors.error("cannot compress images of %s: %s", self._base, error)

    def _compress(self, image: Any) -> tuple[str, bytes]:
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

    def decompress(message: Any) -> None:
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


class ImageInput(NamedTuple):
    """A synchronized input. `transport` defaults to the parameter `~image_transport`."""

    topic: str
    type: str = "sensor_msgs/Image"
    transport: str | None = None


def camera(node: Node, topic: str) -> tuple[ImageInput, ImageInput]:
    """Return the inputs for an image topic and the `camera_info` in the same namespace."""
    info = names.namespace(node.resolve(topic)) + "camera_info"
    return ImageInput(topic), ImageInput(info, "sensor_msgs/CameraInfo")


def synchronized(
    node: Node,
    inputs: Sequence[ImageInput],
    callback: Callable[..., object],
    queue_size: int,
    *,
    is_exact: bool = True,
    topic_queue_size: int | None = None,
) -> list[Any]:
    """Subscribe, and call `callback` with matching messages, one from each input. Return the subscriptions.

    Args:
        queue_size: maximum number of messages per input that wait for matching messages.
        is_exact: whether matching timestamps must be equal; otherwise, they must differ by less than
            `APPROXIMATE_S`.
        topic_queue_size: the queue size of the subscriptions; defaults to `queue_size`.
    """
    size = max(queue_size, 1)
    matcher: ExactSynchronizer = ExactSynchronizer(len(inputs), size)
    if not is_exact:
        matcher = ApproximateSynchronizer(len(inputs), size, round(APPROXIMATE_S * NS_PER_S))
    lock = threading.Lock()

    def receive(index: int, message: Any) -> None:
        stamp = message.header.stamp
        with lock:
            queue = matcher.queues[index]
            for complete in matcher.add(message, stamp.to_nsec(), queue, index, None):
                callback(*complete)

    subscriptions = []
    for index, each in enumerate(inputs):

        def on_message(message: Any, index: int = index) -> None:
            receive(index, message)

        limit = topic_queue_size or size
        if each.type == "sensor_msgs/Image":
            subscriptions.append(subscribe_image(node, each.topic, on_message, limit, each.transport))
        else:
            kind = load_message_class(each.type)
            subscriptions.append(
                node.subscribe(each.topic, kind, on_message, queue_size=limit, zero_copy=True)
            )
    return subscriptions


def enum(**constants: int) -> str:
    """Return the edit method of a setting whose value must be one of the constants."""
    listed = [{"name": name, "value": value, "type": "int"} for name, value in constants.items()]
    return repr({"enum": listed, "enum_description": ""})


def inside(node: Node, namespace: str, name: str) -> str:
    """Resolve a topic name in a namespace. The namespace and the result can be remapped."""
    return node.resolve(f"{node.resolve(namespace)}/{name}")
