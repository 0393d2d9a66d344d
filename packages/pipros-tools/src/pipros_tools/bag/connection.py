"""Connections and their messages. A connection represents one publisher of one topic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from pipros_tools.bag.errors import BagFormatError, UnusableConnection
from pipros_tools.bag.records import U32, Fields, Op, field_bytes, number, parse_fields, record_bytes, text_of


@dataclass(frozen=True, slots=True)
class Connection:
    """A connection: one publisher of one topic, with its connection header.

    Attributes:
        id: the connection's number in the file.
        topic: the topic on which the messages are played.
        header: the fields of the connection header, as bytes; texts are encoded. They are `type`, `md5sum`,
            `message_definition`, and optionally `callerid`, `latching`, and `topic` (the publisher's name
            for the topic).
        type, md5sum, definition: the corresponding header fields as text.
    """

    id: int
    topic: str
    header: Mapping[str, bytes]
    type: str = field(init=False)
    md5sum: str = field(init=False)
    definition: str = field(init=False)

    def __post_init__(self) -> None:
        if not all(isinstance(value, bytes) for value in self.header.values()):
            header = {key: v if isinstance(v, bytes) else str(v).encode() for key, v in self.header.items()}
            object.__setattr__(self, "header", header)
        for name, source in (("type", "type"), ("md5sum", "md5sum"), ("definition", "message_definition")):
            object.__setattr__(self, name, text_of(self.header.get(source, b"")))

    @property
    def is_latching(self) -> bool:
        return self.header.get("latching") == b"1"

    @property
    def callerid(self) -> str:
        return text_of(self.header.get("callerid", b""))


class StoredMessage(NamedTuple):
    """A serialized message, read from a file or to be written to one.

    Attributes:
        time_ns: time of receipt.
        sequence, published_ns: number and time from the publisher, in MCAP files; otherwise 0.
    """

    connection: Connection
    time_ns: int
    data: bytes
    sequence: int = 0
    published_ns: int = 0


def received_connection(topic: str, header: Mapping[str, str]) -> Connection:
    """Return a connection with the number 0, for messages from a publisher that sent `header`."""
    fields = {name: value.encode() for name, value in header.items()}
    defaults = {"topic": topic.encode(), "type": b"", "md5sum": b"", "message_definition": b""}
    return Connection(0, topic, fields | {k: v for k, v in defaults.items() if k not in fields})


def parse_connection(fields: Fields, data: bytes, where: str) -> Connection:
    """Parse a connection record.

    Raises:
        UnusableConnection: the connection header is damaged, or the type is missing.
        BagFormatError: the topic or number is missing.
    """
    identity = number(fields, "conn", 4, where)
    if "topic" not in fields:
        raise BagFormatError(f"{where}: a connection must have a topic")
    topic = text_of(fields["topic"])
    try:
        header = parse_fields(data, f"{where}, the connection header")
    except BagFormatError as error:
        raise UnusableConnection(topic, str(error)) from None
    if not header.get("type"):
        raise UnusableConnection(topic, f"{where}: a connection must have a type")
    return Connection(identity, topic, header)


def connection_record(connection: Connection) -> bytes:
    """Return the record for a connection."""
    fields = {
        "op": bytes([Op.CONNECTION]),
        "topic": connection.topic.encode(),
        "conn": U32.pack(connection.id),
    }
    return record_bytes(fields, field_bytes(connection.header))
