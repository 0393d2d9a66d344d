"""Private methods of `Bag` that other programs use, such as rqt_bag and bag editors.

Names and meanings are the same as in genuine rosbag. The index is read on first use.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import total_ordering
from typing import Any

from pipros.bag.connection import Connection
from pipros.bag.message_index import MessageIndex, Position
from pipros.bag.reader import BagReader
from pipros.basics.limits import process_limits
from pipros.basics.names import canonicalize
from rosbag.contents import BagContents
from rosbag.exceptions import translated
from rosbag.results import BagMessage, BagMessageWithConnectionHeader
from rospy.rostime import Time

ConnectionFilter = Callable[[str, str, str, str, Mapping[str, bytes]], bool]


class ConnectionInfo:
    """A connection, with rosbag's attribute names."""

    def __init__(self, connection: Connection) -> None:
        self.id = connection.id
        self.topic = connection.topic
        self.datatype = connection.type
        self.md5sum = connection.md5sum
        self.msg_def = connection.definition
        self.header = connection.header

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
    """Location of a message, ordered by its time alone. Pass `position` to `_read_message`."""

    __slots__ = ("chunk_pos", "offset", "time")

    def __init__(self, position: Position, is_chunked: bool) -> None:
        self.time = Time(position.seconds, position.nanoseconds)
        self.chunk_pos = position.chunk if is_chunked else 0
        self.offset = position.offset if is_chunked else position.chunk + position.offset

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
    """Underscored methods and attributes of `Bag` that public code uses."""

    _version: int
    _indexed: tuple[BagReader, MessageIndex, dict[int, list[IndexEntry]]] | None = None
    _infos: dict[int, ConnectionInfo] | None = None

    @property
    def _connections(self) -> dict[int, ConnectionInfo]:
        connections = self._view().connections
        if self._infos is None or len(self._infos) != len(connections):
            self._infos = {each.id: ConnectionInfo(each) for each in connections}
        return self._infos

    @property
    def _chunks(self) -> list[ChunkInfo]:
        if self._version != 200:
            return []
        return [
            ChunkInfo(each.position, Time(*each.start), Time(*each.end), each.counts)
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
        return self._index()[1]

    @property
    def _has_compressed_chunks(self) -> bool:
        return any(header.compression != "none" for header in self._chunk_headers.values())

    @property
    def _uncompressed_size(self) -> int:
        headers = self._chunk_headers.values()
        return sum(header.uncompressed_size for header in headers) if headers else self._view().size

    def _index(self) -> tuple[MessageIndex, dict[int, list[IndexEntry]]]:
        bag = self._view()
        if self._indexed is None or self._indexed[0] is not bag:
            index = MessageIndex(bag, process_limits())
            with translated():
                entries = {
                    key: [IndexEntry(each, self._version == 200) for each in positions]
                    for key, positions in index.positions().items()
                    if positions
                }
            self._indexed = bag, index, entries
        return self._indexed[1:]

    def _get_connections(
        self, topics: Iterable[str] | str | None = None, connection_filter: ConnectionFilter | None = None
    ) -> Iterator[ConnectionInfo]:
        """Yield the connections of these topics that the filter accepts."""
        for each in self._chosen(self._view(), topics, connection_filter):
            yield ConnectionInfo(each)

    @staticmethod
    def _chosen(
        bag: BagReader, topics: Iterable[str] | str | None, connection_filter: ConnectionFilter | None
    ) -> list[Connection]:
        names = [topics] if isinstance(topics, str) else list(topics or ())
        wanted = {canonicalize(name) for name in names}
        return [
            each
            for each in bag.connections
            if (not wanted or canonicalize(each.topic) in wanted)
            and (
                connection_filter is None
                or connection_filter(each.topic, each.type, each.md5sum, each.definition, each.header)
            )
        ]

    def _get_indexes(self, connections: Iterable[ConnectionInfo] | None) -> list[list[IndexEntry]]:
        indexes = self._index()[1]
        if connections is None:
            return list(indexes.values())
        return [indexes.get(connection.id, []) for connection in connections]

    def _get_entries(
        self,
        connections: Iterable[ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[IndexEntry]:
        """Yield the entries of the connections in time order, between two times, inclusive."""
        for entry in heapq.merge(*self._get_indexes(connections)):
            if end_time and entry.time > end_time:
                return
            if not start_time or entry.time >= start_time:
                yield entry

    def _get_entries_reverse(
        self,
        connections: Iterable[ConnectionInfo] | None = None,
        start_time: Time | None = None,
        end_time: Time | None = None,
    ) -> Iterator[IndexEntry]:
        """Yield the entries of `_get_entries` in reverse order."""
        indexes = (reversed(index) for index in self._get_indexes(connections))
        for entry in heapq.merge(*indexes, reverse=True):
            if start_time and entry.time < start_time:
                return
            if not end_time or entry.time <= end_time:
                yield entry

    def _get_entry(self, t: Time, connections: Iterable[ConnectionInfo] | None = None) -> IndexEntry | None:
        """Return the last entry at or before `t`, or None."""
        indexes = self._get_indexes(connections)
        found = [(index, bisect_right(index, t, key=lambda entry: entry.time)) for index in indexes]
        return max((index[at - 1] for index, at in found if at), default=None)

    def _get_entry_after(
        self, t: Time, connections: Iterable[ConnectionInfo] | None = None
    ) -> IndexEntry | None:
        """Return the first entry after `t`, or None."""
        indexes = self._get_indexes(connections)
        found = [(index, bisect_right(index, t, key=lambda entry: entry.time)) for index in indexes]
        return min((index[at] for index, at in found if at < len(index)), default=None)

    def _read_message(self, position: Any, raw: bool = False, return_connection_header: bool = False) -> Any:
        """Return the message at an entry's position, in the form of `read_messages`."""
        bag = self._view()
        index = self._indexed[1] if self._indexed is not None and self._indexed[0] is bag else None
        index = index or MessageIndex(bag, process_limits())
        with translated():
            if not isinstance(position, tuple):
                before = [each.position for each in bag.chunks if each.position <= position]
                chunk = before[-1] if before else 0
                connection, stamp, data = index.message(chunk, position - chunk)
            else:
                connection, stamp, data = index.message(*position)
            cls = bag.class_of(connection)
            message = (
                (connection.type, data, connection.md5sum, position, cls) if raw else cls().deserialize(data)
            )
        if return_connection_header:
            return BagMessageWithConnectionHeader(connection.topic, message, Time(*stamp), connection.header)
        return BagMessage(connection.topic, message, Time(*stamp))
