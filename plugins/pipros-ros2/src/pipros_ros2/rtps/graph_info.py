"""The topic `ros_discovery_info`, from which ROS 2 lists nodes, and the size of the GIDs in its messages.

A GID is 24 bytes long in Humble and 16 bytes since Iron, and a Humble node that reads 16-byte GIDs may
exhaust its memory and crash (rmw_fastrtps#733). Therefore, nothing is published and no writer is announced
until the size is known, either from other participants' messages or from the user. Once both sizes have been
seen in a domain, nothing further is published.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from struct import Struct, error
from typing import Final, Protocol

from pipros_ros2.rtps.identity import GUID_BYTES
from pipros_ros2.rtps.qos import DurabilityKind, Qos, ReliabilityKind

TOPIC: Final = "ros_discovery_info"
TYPE_NAME: Final = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
TYPE_HASH: Final = b"typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"
"""Entry of USER_DATA. Since Jazzy, rmw_cyclonedds warns if it is missing. Humble has no type hashes."""
WRITER_QOS: Final = Qos(ReliabilityKind.RELIABLE, DurabilityKind.TRANSIENT_LOCAL, depth=1)
READER_QOS: Final = Qos(ReliabilityKind.RELIABLE, DurabilityKind.TRANSIENT_LOCAL, depth=0)

_ENCAPSULATION: Final = b"\0\1\0\0"
_COUNT = Struct("<I")
_MAX_PADDING: Final = 3
_MAX_NAME_BYTES: Final = 257


class GidBytes(IntEnum):
    """Sizes of GIDs, by distribution."""

    HUMBLE = 24
    IRON_AND_LATER = 16


@dataclass(frozen=True, slots=True)
class NodeInfo:
    """A node and the GUIDs of its endpoints. Encoded GUIDs are padded with zeros to the GID size."""

    namespace: str
    name: str
    readers: tuple[bytes, ...] = ()
    writers: tuple[bytes, ...] = ()


@dataclass(frozen=True, slots=True)
class ParticipantInfo:
    """The nodes of one participant."""

    guid: bytes
    nodes: tuple[NodeInfo, ...] = ()


def write_info(info: ParticipantInfo, size: GidBytes) -> bytes:
    """Encode a message for `ros_discovery_info`, with its encapsulation header."""
    body = bytearray(_gid(info.guid, size))
    body += _COUNT.pack(len(info.nodes))
    for node in info.nodes:
        for text in (node.namespace, node.name):
            _align(body)
            encoded = text.encode() + b"\0"
            body += _COUNT.pack(len(encoded)) + encoded
        for guids in (node.readers, node.writers):
            _align(body)
            body += _COUNT.pack(len(guids)) + b"".join(_gid(guid, size) for guid in guids)
    return _ENCAPSULATION + bytes(body)


def _gid(guid: bytes, size: GidBytes) -> bytes:
    return guid.ljust(size, b"\0")


def _align(body: bytearray) -> None:
    body += bytes(-len(body) % 4)


class _Malformed(Exception):
    """The message is malformed, or its GIDs do not have the expected size."""


class _Cursor:
    def __init__(self, body: bytes, size: GidBytes) -> None:
        self._body = body
        self._size = size
        self._position = 0

    def gid(self) -> bytes:
        found = self._take(self._size)
        if any(found[GUID_BYTES:]):
            raise _Malformed
        return found[:GUID_BYTES]

    def count(self) -> int:
        self._position += -self._position % 4
        return int(_COUNT.unpack(self._take(4))[0])

    def text(self) -> str:
        length = self.count()
        if not 0 < length <= _MAX_NAME_BYTES:
            raise _Malformed
        return self._take(length)[:-1].decode()

    def gids(self) -> tuple[bytes, ...]:
        count = self.count()
        if count * self._size > len(self._body):
            raise _Malformed
        return tuple(self.gid() for _ in range(count))

    def is_at_end(self) -> bool:
        return 0 <= len(self._body) - self._position <= _MAX_PADDING

    def _take(self, size: int) -> bytes:
        found = self._body[self._position : self._position + size]
        if len(found) < size:
            raise _Malformed
        self._position += size
        return found


def read_info(payload: bytes, size: GidBytes) -> ParticipantInfo | None:
    """Decode a `ros_discovery_info` message. Return None if it is malformed or its GIDs have another size."""
    cursor = _Cursor(payload[len(_ENCAPSULATION) :], size)
    try:
        guid = cursor.gid()
        nodes: list[NodeInfo] = []
        for _ in range(cursor.count()):
            nodes.append(NodeInfo(cursor.text(), cursor.text(), cursor.gids(), cursor.gids()))
    except (_Malformed, error, UnicodeDecodeError):
        return None
    return ParticipantInfo(guid, tuple(nodes)) if payload[:2] == b"\0\1" and cursor.is_at_end() else None


class Knowledge(Enum):
    """Knowledge of the GID size in a domain; MIXED if both sizes were seen."""

    UNKNOWN = "unknown"
    KNOWN = "known"
    MIXED = "mixed"


class InfoWriter(Protocol):
    """A writer of `ros_discovery_info`."""

    def write(self, payload: bytes) -> object: ...

    def close(self) -> None: ...


class GraphInfo:
    """Tracks the nodes of other participants, and publishes our own nodes.

    Attributes:
        others: the nodes of other participants, by GUID.
    """

    def __init__(
        self, guid: bytes, make_writer: Callable[[], InfoWriter], size: GidBytes | None = None
    ) -> None:
        """Create the graph information of a participant without nodes.

        Args:
            make_writer: function that creates the writer, called before the first publication.
            size: the GID size; None to learn it from the messages of other participants.
        """
        self.others: dict[bytes, ParticipantInfo] = {}
        self._participant = ParticipantInfo(guid)
        self._make_writer = make_writer
        self._writer: InfoWriter | None = None
        self._sizes: set[GidBytes] = set() if size is None else {size}
        self._has_nodes = False

    @property
    def knowledge(self) -> Knowledge:
        return (Knowledge.UNKNOWN, Knowledge.KNOWN, Knowledge.MIXED)[len(self._sizes)]

    @property
    def size(self) -> GidBytes | None:
        """Size of GIDs, or None if it is unknown or differs between participants."""
        return next(iter(self._sizes)) if len(self._sizes) == 1 else None

    def on_message(self, payload: bytes, sender_prefix: bytes) -> None:
        """Handle a message from another participant.

        Ignore the message unless exactly one GID size fits it, and it describes the sender's nodes.
        """
        fitting = {size: info for size in GidBytes if (info := read_info(payload, size))}
        if len(fitting) != 1:
            return
        ((size, info),) = fitting.items()
        if info.guid[:12] != sender_prefix:
            return
        self.forget(sender_prefix)  # a participant has only one entry, so remove one with another GUID
        self.others[info.guid] = info
        if size not in self._sizes:
            self._sizes.add(size)
            self._publish()

    def forget(self, prefix: bytes) -> None:
        """Remove the nodes of a participant that has left."""
        for guid in [each for each in self.others if each[:12] == prefix]:
            del self.others[guid]

    def announce(self, nodes: Sequence[NodeInfo]) -> None:
        """Publish our own nodes, now or as soon as the GID size is known."""
        self._participant = ParticipantInfo(self._participant.guid, tuple(nodes))
        self._has_nodes = True
        self._publish()

    def _publish(self) -> None:
        size = self.size
        if size is None:
            if self._writer is not None:
                self._writer.close()
                self._writer = None
            return
        if self._has_nodes:
            self._writer = self._writer or self._make_writer()
            self._writer.write(write_info(self._participant, size))
