"""Add messages to a bag by topic name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.msg.class_finder import installed_class
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.writer import BagWriter


class TopicWriter:
    """Adapter that adds messages by topic name, with a connection for each topic, type and header."""

    def __init__(self, writer: BagWriter) -> None:
        self._writer = writer
        self._known: dict[Any, Connection] = {}

    def write(
        self,
        topic: str,
        message: Any,
        seconds: int,
        nanoseconds: int,
        header: Mapping[str, Any] | None = None,
    ) -> None:
        """Add a message. Header values may be strings or bytes.

        Raises:
            AttributeError: `message` is not a message.
            SerializationError: a value in the message does not fit its field.
            OSError: see `BagWriter`.
        """
        cls = type(message)
        key = (topic, cls, None if header is None else tuple(header.items()))
        connection = self._known.get(key)
        if connection is None:
            _ = message.serialize  # raises AttributeError for objects that are not messages
            connection = self._known[key] = self.connection_of(topic, (cls._type, cls._md5sum), header, cls)
        self._writer.write_message(connection, seconds, nanoseconds, message)

    def write_raw(
        self,
        topic: str,
        type_name: str,
        md5sum: str,
        data: bytes,
        seconds: int,
        nanoseconds: int,
        header: Mapping[str, Any] | None = None,
        cls: Any = None,
    ) -> None:
        """Add a serialized message. The definition is taken from the header, `cls` or the installed type.

        Raises:
            BagError: no definition is available.
            OSError: see `BagWriter`.
        """
        key = (topic, type_name, md5sum, None if header is None else tuple(header.items()))
        connection = self._known.get(key)
        if connection is None:
            if cls is None and "message_definition" not in (header or {}):
                cls = installed_class(type_name)
                if cls is None:
                    raise BagError(
                        f"cannot locate message class and no message class provided for [{type_name}]"
                    )
            connection = self._known[key] = self.connection_of(topic, (type_name, md5sum), header, cls)
        self._writer.write(connection, seconds, nanoseconds, data)

    def connection_of(
        self, topic: str, names: tuple[str, str], header: Mapping[str, Any] | None, cls: Any
    ) -> Connection:
        """Return the connection with this header, adding it if necessary."""
        given = {name: _as_bytes(value) for name, value in (header or {}).items()}
        needed = {
            "topic": topic,
            "type": names[0],
            "md5sum": names[1],
            "message_definition": getattr(cls, "_full_text", ""),
        }
        fields = {**{name: _as_bytes(value) for name, value in needed.items()}, **given}
        if header is not None:
            fields = given | {name: value for name, value in fields.items() if name not in given}
        for connection in self._writer.layout.connections.values():
            if connection.topic == topic and dict(connection.header) == fields:
                return connection
        return self._writer.add_connection(topic, fields)


def _as_bytes(value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode()
