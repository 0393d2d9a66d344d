"""Random access to the messages in a bag, for programs such as viewers."""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from operator import attrgetter
from typing import NamedTuple

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.chunk_data import LARGE_BYTES, read_chunk_data
from pipros_tools.bag.compression import NONE
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import Fields, Op, number, op_of, parse_entries, parse_head, text_of, time_of


class Position(NamedTuple):
    """Location of a message: its timestamp, the position of its chunk, and its offset in the chunk.

    In bags in format 1.2, which do not have chunks, `chunk` is 0 and `offset` is the position in the file.
    """

    time_ns: int
    chunk: int
    offset: int


_time_of = attrgetter("time_ns")


class MessageIndex:
    """Index of all messages in a bag, read on first use, with access to messages by position.

    The most recently decompressed chunk is cached.
    """

    def __init__(self, bag: BagReader) -> None:
        self.bag = bag
        self._is_chunked = bag.layout.version.number == 200
        self._positions: dict[int, list[Position]] | None = None
        self._numbers: dict[int, int] = {}
        self._kept: tuple[int, bytes] = (-1, b"")

    def positions(self) -> dict[int, list[Position]]:
        """Return each connection's positions in time order, by connection number.

        Raise `BagFormatError` if the bag is damaged.
        """
        if self._positions is None:
            found: dict[int, list[Position]] = {}
            for at, chunk in enumerate(self.bag.chunks):
                place, base = (chunk.position, 0) if self._is_chunked else (0, chunk.position)
                for connection, data in self.bag.chunk_index(at).items():
                    found.setdefault(connection, []).extend(
                        Position(time_ns, place, base + offset) for time_ns, _, offset in parse_entries(data)
                    )
            for each in found.values():
                each.sort()
            self._positions = found
        return self._positions

    def between(
        self,
        connections: Iterable[int] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        reverse: bool = False,
    ) -> Iterator[Position]:
        """Return an iterator over the positions of messages between two timestamps, inclusive, in time order.

        Args:
            connections: numbers of the connections; defaults to all.
            reverse: whether to start with the last message.
        """
        parts = []
        for each in self._indexes(connections):
            begin = 0 if start_ns is None else bisect_right(each, start_ns - 1, key=_time_of)
            end = len(each) if end_ns is None else bisect_right(each, end_ns, key=_time_of)
            parts.append(each[begin:end][:: -1 if reverse else 1])
        return heapq.merge(*parts, key=_time_of, reverse=reverse)

    def last_until(self, time_ns: int, connections: Iterable[int] | None = None) -> Position | None:
        """Return the position of the last message at or before a time, or None if there is none."""
        ends = ((each, bisect_right(each, time_ns, key=_time_of)) for each in self._indexes(connections))
        return max((each[end - 1] for each, end in ends if end), key=_time_of, default=None)

    def first_after(self, time_ns: int, connections: Iterable[int] | None = None) -> Position | None:
        """Return the position of the first message after a time, or None if there is none."""
        ends = ((each, bisect_right(each, time_ns, key=_time_of)) for each in self._indexes(connections))
        return min((each[end] for each, end in ends if end < len(each)), key=_time_of, default=None)

    def _indexes(self, connections: Iterable[int] | None) -> list[list[Position]]:
        positions = self.positions()
        return [positions.get(key, []) for key in (positions if connections is None else connections)]

    def message(self, chunk: int, offset: int) -> StoredMessage:
        """Return the message at a position.

        Raises:
            BagFormatError: there is no valid message at this position.
        """
        if not self._is_chunked and not chunk:
            chunk = max((each.position for each in self.bag.chunks if each.position <= offset), default=0)
            offset -= chunk
        where = f"{self.bag.name}, chunk at byte {chunk}, offset {offset}"
        read = self._reading(chunk, where)
        fields, data_position, data_size = parse_head(read, offset, where)
        if op_of(fields, where) != Op.MESSAGE:
            raise BagFormatError(f"{where}: there is no message")
        if "conn" in fields:
            connection = self.bag.layout.connections.get(number(fields, "conn", 4, where))
            time_ns = time_of(fields, "time", where)
        else:
            connection = self._old_connection(fields)
            time_ns = number(fields, "sec", 4, where) * NS_PER_S + number(fields, "nsec", 4, where)
        if connection is None:
            raise BagFormatError(f"{where}: the message belongs to an unknown connection")
        return StoredMessage(connection, time_ns, read(data_position, data_size))

    def _old_connection(self, fields: Fields) -> Connection | None:
        """Return the connection of a message in a format 1.2 bag, given the fields of its record."""
        wanted = tuple(text_of(fields.get(name, b"")) for name in ("topic", "type", "md5"))
        found = (c for c in self.bag.connections if (c.topic, c.type, c.md5sum) == wanted)
        return next(found, None)

    def _reading(self, chunk: int, where: str) -> Callable[[int, int], bytes]:
        """Return a function that reads a given number of bytes at a given offset in a chunk."""
        if len(self._numbers) != len(self.bag.chunks):
            self._numbers = {each.position: at for at, each in enumerate(self.bag.chunks)}
        at = self._numbers.get(chunk)
        if at is None:
            raise BagFormatError(f"{where}: there is no chunk")
        header = self.bag.chunk_header(at)
        kept = self._kept  # another thread may replace it
        is_in_file = header.compression == NONE and (header.size > LARGE_BYTES or kept[0] != chunk)
        if not is_in_file and kept[0] != chunk:
            self._kept = kept = (chunk, read_chunk_data(self.bag.source, header))

        def read(position: int, size: int) -> bytes:
            if position + size > header.size:
                raise BagFormatError(f"{where}: the message does not fit into its chunk")
            if is_in_file:
                return self.bag.source.read(header.data_position + position, size)
            return kept[1][position : position + size]

        return read
