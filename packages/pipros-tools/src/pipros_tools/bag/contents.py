"""What a bag contains: its connections and chunks, and the counts and times of its messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import NoMessages
from pipros_tools.bag.index import ChunkHeader, ChunkInfo
from pipros_tools.bag.layout import BagLayout, read_chunk_header, read_chunk_index
from pipros_tools.bag.records import parse_entries
from pipros_tools.bag.source import Source
from pipros_tools.bag.times import Stamp

_MANY: Final = 64
"""Indexes of chunks with at least this number of connections are kept: reading topic after topic would read
each index once for each topic.
"""
_KEPT_BYTES: Final = 16 * 1024 * 1024
"""Maximum size of the indexes that are kept of a bag."""
_ENTRIES_BYTES: Final = 200
"""Memory of the entries of a connection in addition to their content."""


class BagContents:
    """The contents of a bag without its messages.

    Args:
        source: the bag's file, for random access.
        layout: its connections and chunks.
    """

    def __init__(self, source: Source, layout: BagLayout) -> None:
        self.source = source
        self.layout = layout
        self._chunk_headers: dict[int, ChunkHeader] = {}
        self._indexes: dict[int, Mapping[int, bytes]] = {}
        self._kept_bytes = 0
        self._by_topic: tuple[int, dict[str, list[Connection]]] = 0, {}

    @property
    def name(self) -> str:
        return self.source.name

    @property
    def format_name(self) -> str:
        """The format version, as displayed by `rosbag info`: `2.0`."""
        return f"{self.layout.version.major}.{self.layout.version.minor}"

    @property
    def size(self) -> int:
        """The size of the file in bytes."""
        return self.source.size

    @property
    def damage(self) -> list[str]:
        """Descriptions of the damage found while scanning the file, one for each damaged position."""
        return self.layout.damage

    @property
    def connections(self) -> list[Connection]:
        """All connections, in file order."""
        return list(self.layout.connections.values())

    @property
    def chunks(self) -> list[ChunkInfo]:
        return self.layout.chunks

    @property
    def message_count(self) -> int:
        return sum(sum(chunk.counts.values()) for chunk in self.layout.chunks)

    def count_by_connection(self) -> dict[int, int]:
        """Return the number of messages in each connection, by connection number."""
        counts = dict.fromkeys(self.layout.connections, 0)
        for chunk in self.layout.chunks:
            for connection, count in chunk.counts.items():
                counts[connection] = counts.get(connection, 0) + count
        return counts

    @property
    def start(self) -> Stamp:
        """Timestamp of the first message: seconds and nanoseconds.

        Raises:
            NoMessages: the bag is empty.
        """
        return divmod(self.range_ns[0], NS_PER_S)

    @property
    def end(self) -> Stamp:
        """Timestamp of the last message. Raises `NoMessages` if the bag is empty."""
        return divmod(self.range_ns[1], NS_PER_S)

    @property
    def range_ns(self) -> tuple[int, int]:
        """Timestamps (ns) of the first and last message. Raises `NoMessages` if the bag is empty."""
        filled = [chunk for chunk in self.layout.chunks if chunk.counts]
        if not filled:
            raise NoMessages(f"{self.source.name} has no messages")
        return min(chunk.start_ns for chunk in filled), max(chunk.end_ns for chunk in filled)

    def chunk_header(self, number: int) -> ChunkHeader:
        """Return the header of the chunk with the given index in `chunks`.

        Raises:
            BagFormatError: the header is damaged.
        """
        header = self._chunk_headers.get(number)
        if header is None:
            position = self.layout.chunks[number].position
            header = self._chunk_headers[number] = read_chunk_header(self.source, self.layout, position)
        return header

    def chunk_index(self, number: int) -> Mapping[int, bytes]:
        """Return a chunk's packed index entries by connection number.

        Raise `BagFormatError` if the entries are damaged.
        """
        if (found := self._indexes.get(number)) is not None:
            return found
        chunks = self.layout.chunks
        end = chunks[number + 1].position if number + 1 < len(chunks) else self.source.size
        found = read_chunk_index(self.source, self.layout, chunks[number], self.chunk_header(number), end)
        size = sum(len(each) + _ENTRIES_BYTES for each in found.values())
        if len(found) >= _MANY and self._kept_bytes + size <= _KEPT_BYTES:
            self._kept_bytes += size
            self._indexes[number] = found
        return found

    def times(self, connections: Iterable[Connection]) -> list[Stamp]:
        """Return the timestamps of all messages in the connections, in time order."""
        found = self.times_by_connection()
        return sorted(stamp for connection in connections for stamp in found.get(connection.id, ()))

    def times_by_connection(self) -> dict[int, list[Stamp]]:
        """Return the timestamps (s, ns) of all messages by connection number, in file order."""
        return {key: [divmod(time, NS_PER_S) for time in times] for key, times in self.times_ns().items()}

    def times_ns(self) -> dict[int, list[int]]:
        """Return the timestamps (ns) of all messages by connection number, in file order."""
        found: dict[int, list[int]] = {}
        for number in range(len(self.layout.chunks)):
            for connection, data in self.chunk_index(number).items():
                found.setdefault(connection, []).extend(time for time, _, _ in parse_entries(data))
        return found

    def connections_by_topic(self) -> dict[str, list[Connection]]:
        """Return all connections, in file order, by topic."""
        found: dict[str, list[Connection]] = {}
        for connection in self.layout.connections.values():
            found.setdefault(connection.topic, []).append(connection)
        return found

    def connections_of(self, topics: Iterable[str] | str | None) -> list[Connection]:
        """Return the connections for the given topics, or all connections if `topics` is None."""
        if topics is None:
            return self.connections
        if isinstance(topics, str):
            count = len(self.layout.connections)  # connections are only added
            if self._by_topic[0] != count:
                self._by_topic = count, self.connections_by_topic()
            return list(self._by_topic[1].get(topics, ()))
        wanted = set(topics)
        return [connection for connection in self.connections if connection.topic in wanted]
