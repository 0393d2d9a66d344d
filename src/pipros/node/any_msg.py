"""Messages of any type, undecoded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pipros.msg.base import Message


class RawMessage(Message):
    """The body of a message of any type, as received. Subscribe with it to any topic.

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
    def _from_bytes(cls, data: bytes | memoryview) -> RawMessage:
        return cls(bytes(data))

    def serialize(self, buff: Any) -> None:
        buff.write(self.body)

    @property
    def header(self) -> Mapping[str, str]:
        fields: Mapping[str, str] = self._connection_header
        return fields
