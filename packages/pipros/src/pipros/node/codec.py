"""Encoders and decoders for a message class, chosen once per topic or service."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from pipros.basics.extras import required
from pipros.net.backlog import Buffer, WireMessage

if TYPE_CHECKING:
    from pipros.msg.base import Message

AnyMessage = TypeVar("AnyMessage", bound="Message")

JOIN_LIMIT_BYTES = 32 * 1024
"""Messages up to this size are joined with their length and written with one plain send. The buffers of
larger messages are not joined.
"""

_pack_length = struct.Struct("<I").pack


def class_named(message_class: type[Message] | str) -> type[Message]:
    """Return the message class, which may be given by the name of its type.

    Raises:
        NotFound: the type does not exist.
        DefinitionError: its definition is invalid.
    """
    if not isinstance(message_class, str):
        return message_class
    from pipros.msg import load_message_class

    return load_message_class(message_class)


def encoder(message_class: type[Message]) -> Callable[[Any], list[Buffer]]:
    """Return the fastest encoder for a class.

    The encoder returns one or more buffers, without a length field.
    """
    to_buffers: Callable[[Any], list[Buffer]] | None = getattr(message_class, "_to_buffers", None)
    return to_buffers if to_buffers is not None else _serialize


def decoder(message_class: type[Message]) -> Callable[[memoryview | bytes], Any]:
    """Return the fastest decoder for a class.

    Classes from genuine generators can decode only bytes, so their data is converted to bytes.
    """
    from_bytes: Callable[[memoryview | bytes], Any] | None = getattr(message_class, "_from_bytes", None)
    if from_bytes is not None:
        return from_bytes
    return lambda data: message_class().deserialize(bytes(data))


def view_decoder(message_class: type[Message]) -> Callable[[memoryview | bytes], Any]:
    """Return a decoder that creates read-only arrays over the data, for `uint8[]` and `char[]` fields.

    Classes with `_has_numpy_arrays` also get them for arrays of other numbers. The data of a `memoryview` is
    copied, unless it belongs to a numpy array, because the receive buffer is reused. Classes from genuine
    generators, and `AnyMsg`, are decoded as usual.

    Raises:
        MissingExtra: numpy is not installed.
    """
    numpy = required("numpy", "zero_copy=True needs numpy", "numpy")
    if not hasattr(message_class, "_deserialize_views"):
        return decoder(message_class)
    has_numbers = bool(getattr(message_class, "_has_numpy_arrays", False))

    def decode(data: memoryview | bytes) -> Any:
        if isinstance(data, memoryview) and not isinstance(data.obj, numpy.ndarray):
            data = bytes(data)
        message: Any = message_class.__new__(message_class)
        return message._deserialize_views(data, numpy, has_numbers=has_numbers)

    return decode


def number(message: Message, sequence: int) -> None:
    """Set the sequence number of a message that starts with a header, as rospy does before sending.

    A frame ID of None is replaced by `0`."""
    if getattr(message, "_has_header", False):
        header: Any = message.header  # type: ignore[attr-defined]
        header.seq = sequence & 0xFFFFFFFF
        if header.frame_id is None:
            header.frame_id = "0"


class TopicEncoder:
    """Encodes the messages of one topic, and numbers them if they start with a header.

    Attributes:
        sequence: the number of the last message.
    """

    __slots__ = ("_encode", "_has_header", "sequence")

    def __init__(self, message_class: type[Message]) -> None:
        self._encode = encoder(message_class)
        self._has_header = bool(getattr(message_class, "_has_header", False))
        self.sequence = 0

    def encode(self, message: Message) -> tuple[WireMessage, int]:
        """Return the message in wire format, and its size including the length field."""
        if self._has_header:
            self.number(message)
        buffers = self._encode(message)
        if len(buffers) == 1 and len(buffers[0]) <= JOIN_LIMIT_BYTES:
            size = len(buffers[0])
            return (_pack_length(size) + buffers[0],), size + 4
        size = sum(map(len, buffers))
        if size <= JOIN_LIMIT_BYTES:
            return (b"".join((_pack_length(size), *buffers)),), size + 4
        return (_pack_length(size), *buffers), size + 4

    def number(self, message: Message) -> None:
        """Set the next sequence number, as the function `number` does, which would be a call per message."""
        if self._has_header:
            self.sequence = (self.sequence + 1) & 0xFFFFFFFF  # sequence numbers are uint32 and wrap around
            header: Any = message.header  # type: ignore[attr-defined]
            header.seq = self.sequence
            if header.frame_id is None:
                header.frame_id = "0"


def _serialize(message: Message) -> list[Buffer]:
    """Serialize a message whose class was created by a genuine generator and writes only to file objects."""
    file = io.BytesIO()
    message.serialize(file)
    return [file.getvalue()]
