"""`AnyMsg`, and conversion of `publish` arguments into messages."""

from __future__ import annotations

import io
import struct
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO, ClassVar, TypeVar

from pipros.msg.base import Message
from pipros.msg.errors import DeserializationError
from pipros.node.codec import number
from rospy.exceptions import ROSException

_LENGTH = struct.Struct("<I")

MessageClass = TypeVar("MessageClass", bound=Message)


class AnyMsg(Message):
    """A message of any type, with its serialized body in `_buff`. Used to subscribe to and relay messages."""

    _md5sum: ClassVar[str] = "*"
    _type: ClassVar[str] = "*"
    _has_header: ClassVar[bool] = False
    _full_text: ClassVar[str] = ""
    __slots__ = ["_buff"]
    _slot_types: ClassVar[list[str]] = []

    def __init__(self, *args: Any) -> None:
        """Create an empty message.

        Raises:
            ROSException: arguments were passed.
        """
        if args:
            raise ROSException("AnyMsg does not accept arguments")
        self._buff: Any = None

    @classmethod
    def _from_bytes(cls, data: bytes | memoryview) -> AnyMsg:
        message = cls()
        message._buff = bytes(data)
        return message

    def serialize(self, buff: Any) -> None:
        """Write the received bytes.

        Raises:
            ROSException: the message does not contain any bytes.
        """
        if self._buff is None:
            raise ROSException("AnyMsg is not initialized")
        buff.write(self._buff)

    def deserialize(self, str: Any) -> AnyMsg:  # noqa: A002  # genpy's name for it
        """Store the bytes unchanged."""
        self._buff = str
        return self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AnyMsg) and self._buff == other._buff

    __hash__ = None


def serialize_message(b: BinaryIO, seq: int, msg: Message) -> None:
    """Write a message in wire format, preceded by its length.

    If the message has a header, set `header.seq` to `seq`.

    Raises:
        SerializationError: a value does not fit the type of its field. Nothing was written.
    """
    number(msg, seq)
    body = io.BytesIO()
    msg.serialize(body)
    b.write(_LENGTH.pack(body.tell()) + body.getvalue())


def deserialize_messages(
    b: io.BytesIO,
    msg_queue: list[Any],
    data_class: type[Message],
    queue_size: int | None = None,
    max_msgs: int | None = None,
    start: int = 0,
) -> None:
    """Move the complete messages from a buffer to the end of a list.

    An incomplete message remains in the buffer, at the offset `start`. Bytes before `start` are not changed.

    Args:
        b: messages in the format of `serialize_message`, up to the buffer's position.
        queue_size: the maximum length of the list. Surplus messages are removed from the start of the list,
            including messages that it already contained. None or 0 for no limit.
        max_msgs: the maximum number of messages to read; None or 0 for no limit.
        start: the offset at which to start.

    Raises:
        genpy.DeserializationError: the bytes are not a message of class `data_class`. The messages
            before the invalid one have been added to the list.
    """
    try:
        end = b.tell()
        b.seek(min(start, end))
        data = b.read(end - b.tell())
        if len(data) < _LENGTH.size:
            return
        bodies, read = _split(data, max_msgs)
        if queue_size is not None:
            bodies = bodies[-queue_size:]
        for body in bodies:
            msg_queue.append(data_class().deserialize(body))
        if queue_size is not None:
            del msg_queue[:-queue_size]
        if read:
            b.seek(start)
            b.truncate()
            b.write(data[read:])
    except Exception as error:
        raise DeserializationError(f"cannot deserialize: {error}") from error


def _split(data: bytes, limit: int | None) -> tuple[list[bytes], int]:
    """Return the bodies of the complete messages, up to `limit`, and the number of bytes that they occupy."""
    bodies: list[bytes] = []
    at = 0
    while len(data) - at >= _LENGTH.size:
        (length,) = _LENGTH.unpack_from(data, at)
        begin = at + _LENGTH.size
        if len(data) - begin < length:
            break
        at = begin + length
        bodies.append(data[begin:at])
        if limit and len(bodies) >= limit:
            break
    return bodies, at


def args_kwds_to_message(
    data_class: type[MessageClass], args: Sequence[Any], kwds: Mapping[str, Any]
) -> MessageClass:
    """Return the message to send, given the arguments of `publish` or of a service call.

    The arguments are a message or its field values.

    Raises:
        TypeError: the message has another type, the number of fields is wrong, or both positional and keyword
            arguments were passed.
        AttributeError: a keyword is not a field.
    """
    if args and kwds:
        raise TypeError("publish() can be called with arguments or keywords, but not both.")
    if kwds:
        return data_class(**kwds)
    if len(args) == 1 and hasattr(args[0], "_md5sum"):
        return _message_for(data_class, args[0])
    if len(args) == 1:
        refuse_ros2(args[0])
    return data_class(*args)


def refuse_ros2(value: object) -> None:
    """Raise ValueError if a class or a message is ROS 2's, which has the same names in one environment."""
    if hasattr(type(value), "__import_type_support__") or hasattr(value, "__import_type_support__"):
        from pipros.msg.importing.modules import why_not_ros1

        raise ValueError(why_not_ros1(value))


def _message_for(data_class: type[MessageClass], one: Any) -> MessageClass:
    """Return the message for a single argument, which is the message or the value of its only field."""
    if isinstance(one, data_class):
        return one
    if one._type == data_class._type and one._md5sum == data_class._md5sum:
        return one  # type: ignore[no-any-return]  # its class was loaded twice
    if [one._type] == data_class._slot_types[:1]:
        return data_class(one)
    expected = data_class._slot_types[0] if data_class._slot_types else data_class._type
    raise TypeError(f"expected [{expected}] but got [{one._type}]")
