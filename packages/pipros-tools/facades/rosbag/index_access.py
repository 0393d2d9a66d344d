"""Private methods of `Bag` that other programs, such as rqt_bag and bag editors, use.

Names and meanings are the same as in genuine rosbag. The index is read on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import total_ordering
from typing import Any

from pipros_tools.bag.connection import Connection
from pipros_tools.bag.message_index import MessageIndex, Position
from pipros_tools.bag.reader import BagReader
from rosbag.contents import BagContents, connections_on
from rosbag.exceptions import translated
from rosbag.results import BagMessage, BagMessageWithConnectionHeader
from rospy.rostime import Time

ConnectionFilter = Callable[[str, str, str, str, Mapping[str, bytes]], bool]


class ConnectionInfo:
    """A connection, with the attribute names of genuine rosbag."""

    def __init__(self, id: int, topic: str, header: Mapping[str, Any]) -> None:  # noqa: A002 # as in Noetic
        connection = Connection(id, topic, header)
        self.id = id
        self.topic = connection.topic
        self.datatype = connection.type
        self.md5sum = connection.md5sum
        self.msg_def = connection.definition
        self.header = connection.header

    @classmethod
    def of(cls, connection: Connection) -> ConnectionInfo:
        return cls(connection.id, connection.topic, connection.header)

    def __str__(self) -> str:
        return f"{self.id} on {self.topic}: {self.header}"


class ChunkInfo:
    """Index entry of a chunk."""

    def __init__(self, pos: int, start_time: Time, end_time: Time, counts: Mapping[int, int]) -> None:
        self.pos = pos
        self.start_time = start_time
        self.end_time = end_time
        self.connection_counts = dict(counts)


class ChunkHeader:
    """The header of a chunk."""

    def __init__(self, compression: str, sizes: tuple[int, int], data_pos: int) -> None:
        self.compression = compression
        self.compressed_size, self.uncompressed_size = sizes
        self.data_pos = data_pos


@total_ordering
class IndexEntry:
    """Location of a message. Entries are ordered by time only. Pass `position` to `_read_message`."""

    __slots__ = ("chunk_pos", "offset", "time")

    def __init__(self, position: Position) -> None:
        time_ns, self.chunk_pos, self.offset = position
        self.time = Time(0, time_ns)

    @property
    def position(self) -> Any:
        return (self.chunk_pos, self.offset) if self.chunk_pos else self.offset

    def __eq__(self, other: object) -> bool:
        return isinstance(other, IndexEntry) and self.time == other.time

    def __lt__(self, other: IndexEntry) -> bool:
        return bool(self.time < other.time)

    __hash__ = None  # type: ignore[assignment] # as in rosbag

    def __str__(self) -> str:
        place = f"{self.chunk_pos}+{self.offset}" if self.chunk_pos else str(self.offset)
        return f"{self.time.secs}.{self.time.nsecs}: {place}"


class IndexAccess(BagContents):
    """Underscored methods and attributes of `Bag` that other programs use."""

    _version: int
    _indexed: MessageIndex | None = None
    _entries: tuple[MessageIndex, dict[int, list[IndexEntry]]] | None = None
    _infos: dict[int, ConnectionInfo] | None = None

    @property
    def _connections(self) -> dict[int, ConnectionInfo]:
        connections = self._view().connections
        infos = self._infos
        if infos is None or len(infos) != len(connections):
            self._infos = infos = {each.id: ConnectionInfo.of(each) for each in connections}
        return infos

    @property
    def _topic_connections(self) -> dict[str, ConnectionInfo]:
        return {each.topic: each for each in self._connections.values()}

    @property
    def _chunks(self) -> list[ChunkInfo]:
        if self._version != 200:
            return []
        return [
            ChunkInfo(each.position, Time(0, each.start_ns), Time(0, each.end_ns), each.counts)
            for each in self._view().chunks
        ]

    @property
    def _chunk_headers(self) -> dict[int, ChunkHeader]:
        if self._version != 200:
            return {}
        bag = self._view()
        found = {}
        for number, chunk in enumerate(bag.chunks):
            header = bag.chunk_header(number)
            sizes = header.data_size, header.size
            found[chunk.position] = ChunkHeader(header.compression, sizes, header.data_position)
        return found

    @property
    def _connection_indexes(self) -> dict[int, list[IndexEntry]]:
        index = self._index()
        known = self._entries
        if known is None or known[0] is not index:
            with translated():
                positions = index.positions()
            entries = {key: [IndexEntry(each) for each in found] for key, found in positions.items() if found}
            self._entries = known = index, entries
        return known[1]

    @property
    def _has_compressed_chunks(self) -> bool:
        return any(header.compression != "none" for header in self._chunk_headers.values())

    @property
    def _uncompressed_size(self) -> int:
        headers = self._chunk_headers.values()
        return sum(header.uncompressed_size for header in headers) if headers else self._view().size

    def _clear_index(self) -> None:
        """Forget what was read of the index; it is read again when it is needed."""
        self._indexed = self._entries = self._infos = None

    def _index(self) -> MessageIndex:
        bag = self._view()
        index = self._indexed
        if index is None or index.bag is not bag:
            self._indexed = index = MessageIndex(bag)
        return index

    def _get_connections(
        self, topics: Iterable[str] | str | None = None, connection_filter: ConnectionFilter | None = None
    ) -> Iterator[ConnectionInfo]:
        """Return an iterator over the connections on the given topics that the filter accepts."""
        return map(ConnectionInfo.of, self._chosen(self._view(), topics, connection_filter))

    @staticmethod
    def _chosen(
        bag: BagReader, topics: Iterable[str] | str | None, connection_filter: ConnectionFilter | None
    ) -> list[Connection]:
        found = connections_on(bag, topics) if topics else bag.connections
        if connection_filter is None:
            return found
        return [c for c in found if connection_filter(c.topic, c.type, c.md5sum, c.definition, c.header)]

    def _get_indexes(self, connections: Iterable[ConnectionInfo] | None) -> list[list[IndexEntry]]:
        indexes = self._connection_indexes
        if connections is None:
            return list(indexes.values())
        return [indexes.get(connection.id, []) for connection in connections]

    def _get_entries(
        self,
        connections: Iterable[ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[IndexEntry]:
        """Return the entries for messages on the connections between two times, inclusive, in time order."""
        return self._between(connections, start_time, end_time)

    def _get_entries_reverse(
        self,
        connections: Iterable[ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[IndexEntry]:
        """Like `_get_entries`, but in reverse order."""
        return self._between(connections, start_time, end_time, reverse=True)

    def _between(
        self,
        connections: Iterable[ConnectionInfo] | None,
        *times: Time | None,
        reverse: bool = False,
    ) -> Iterator[IndexEntry]:
        start_ns, end_ns = (time.to_nsec() if time else None for time in times)
        with translated():
            found = self._index().between(_numbers(connections), start_ns, end_ns, reverse=reverse)
        return map(IndexEntry, found)

    def _get_entry(self, t: Time, connections: Iterable[ConnectionInfo] | None = None) -> IndexEntry | None:
        """Return the last entry at or before `t`, or None if there is none."""
        with translated():
            found = self._index().last_until(t.to_nsec(), _numbers(connections))
        return found and IndexEntry(found)

    def _get_entry_after(
        self, t: Time, connections: Iterable[ConnectionInfo] | None = None
    ) -> IndexEntry | None:
        """Return the first entry after `t`, or None if there is none."""
        with translated():
            found = self._index().first_after(t.to_nsec(), _numbers(connections))
        return found and IndexEntry(found)

    def _read_message(self, position: Any, raw: bool = False, return_connection_header: bool = False) -> Any:
        """Return the message at an entry's position, in the form of `read_messages`."""
        index = self._index()
        with translated():
            stored = index.message(*(position if isinstance(position, tuple) else (0, position)))
            connection = stored.connection
            message = (
                (connection.type, stored.data, connection.md5sum, position, index.bag.class_of(connection))
                if raw
                else index.bag.decode(stored)
            )
        time = Time(0, stored.time_ns)
        if return_connection_header:
            return BagMessageWithConnectionHeader(connection.topic, message, time, connection.header)
        return BagMessage(connection.topic, message, time)


def _numbers(connections: Iterable[ConnectionInfo] | None) -> list[int] | None:
    return None if connections is None else [connection.id for connection in connections]
