"""Messages of any type, undecoded."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from pipros.msg.base import Message
from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import encoder


class AnyMsg(Message):
    """The serialized body of a message of any type. Pass this class to `subscribe` to accept all types.

    Attributes:
        body: the serialized message.
        header: the publisher's connection header: `type`, `md5sum`, `message_definition`, ….
    """

    _md5sum: ClassVar[str] = "*"
    _type: ClassVar[str] = "*"
    _has_header: ClassVar[bool] = False
    _full_text: ClassVar[str] = ""
    __slots__ = ("body",)
    _slot_types: ClassVar[list[str]] = []

    def __init__(self, body: bytes = b"") -> None:
        self.body = body

    @classmethod
    def _from_bytes(cls, data: bytes | memoryview) -> AnyMsg:
        return cls(bytes(data))

    def serialize(self, buff: Any) -> None:
        buff.write(self.body)

    @property
    def header(self) -> Mapping[str, str]:
        fields: Mapping[str, str] = self._connection_header
        return fields


def taking_raw(callback: Callable[..., object] | None) -> Callable[..., object] | None:
    """Return a callback for decoded messages that passes each message to `callback` as an `AnyMsg`.

    None and a `MessageStream`, which the subscription must recognize, are returned unchanged.
    """
    if callback is None or isinstance(callback, MessageStream):
        return callback

    @functools.wraps(callback)
    def call(message: Message, *args: object) -> None:
        raw = AnyMsg(b"".join(encoder(type(message))(message)))
        raw._connection_header = message._connection_header
        callback(raw, *args)

    return call
