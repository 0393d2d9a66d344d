"""Random access to the messages of a bag, for programs such as viewers."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from pipros.bag.chunk_data import LARGE_BYTES, read_chunk_data
from pipros.bag.compression import NONE
from pipros.bag.connection import Connection
from pipros.bag.errors import BagFormatError
from pipros.bag.index import ENTRY, Stamp
from pipros.bag.reader import BagReader
from pipros.bag.records import Fields, Op, number, op_of, parse_fields, text_of
from pipros.basics.limits import Limits


class Position(NamedTuple):
    """Location of a message: its timestamp, the position of its chunk, and its offset in the chunk."""

    seconds: int
    nanoseconds: int
    chunk: int
    offset: int


class MessageIndex:
    """Index of all messages of a bag, read on first use, with access to messages by position.

    The most recently decompressed chunk is cached.
    """

    def __init__(self, bag: BagReader, limits: Limits) -> None:
        self._bag = bag
        self._limits = limits
        self._positions: dict[int, list[Position]] | None = None
        self._numbers: dict[int, int] = {}
        self._kept: tuple[int, bytes] = (-1, b"")

    def positions(self) -> dict[int, list[Position]]:
        """Return positions in time order, by connection number. Raise `BagFormatError` for a damaged bag."""
        if self._positions is None:
            found: dict[int, list[Position]] = {key: [] for key in self._bag.layout.connections}
            for at, chunk in enumerate(self._bag.chunks):
                for connection, data in self._bag.chunk_index(at).items():
                    found.setdefault(connection, []).extend(
                        Position(seconds, nanoseconds, chunk.position, offset)
                        for seconds, nanoseconds, offset in ENTRY.iter_unpack(data)
                    )
            for each in found.values():
                each.sort()
            self._positions = found
        return self._positions

    def message(self, chunk: int, offset: int) -> tuple[Connection, Stamp, bytes]:
        """Return connection, timestamp and serialized message at a position.

        Raises:
            BagFormatError: there is no message at this position.
        """
        where = f"{self._bag.name}, chunk at byte {chunk}, offset {offset}"
        read = self._reading(chunk, where)
        head_size = int.from_bytes(read(offset, 4), "little")
        fields = parse_fields(read(offset + 4, head_size), where)
        begin = offset + 4 + head_size
        if op_of(fields, where) != Op.MESSAGE:
            raise BagFormatError(f"{where}: there is no message")
        if "conn" in fields:
            connection = self._bag.layout.connections.get(number(fields, "conn", 4, where))
            time = fields.get("time", b"").ljust(8, b"\0")
            stamp = int.from_bytes(time[:4], "little"), int.from_bytes(time[4:8], "little")
        else:
            connection = self._old_connection(fields)
            stamp = number(fields, "sec", 4, where), number(fields, "nsec", 4, where)
        if connection is None:
            raise BagFormatError(f"{where}: the message belongs to an unknown connection")
        return connection, stamp, read(begin + 4, int.from_bytes(read(begin, 4), "little"))

    def _old_connection(self, fields: Fields) -> Connection | None:
        """Return the connection of a message of format 1.2, whose record names its topic and type."""
        wanted = tuple(text_of(fields.get(name, b"")) for name in ("topic", "type", "md5"))
        for each in self._bag.connections:
            if (each.topic, each.type, each.md5sum) == wanted:
                return each
        return None

    def _reading(self, chunk: int, where: str) -> Callable[[int, int], bytes]:
        """Return a function that reads pieces of a chunk."""
        if len(self._numbers) != len(self._bag.chunks):
            self._numbers = {each.position: at for at, each in enumerate(self._bag.chunks)}
        at = self._numbers.get(chunk)
        if at is None:
            raise BagFormatError(f"{where}: there is no chunk")
        header = self._bag.chunk_header(at)
        is_in_file = header.compression == NONE and (header.size > LARGE_BYTES or self._kept[0] != chunk)
        if not is_in_file and self._kept[0] != chunk:
            self._kept = (chunk, read_chunk_data(self._bag.source, header, self._limits))

        def read(position: int, size: int) -> bytes:
            if position + size > header.size:
                raise BagFormatError(f"{where}: the message does not fit into its chunk")
            if is_in_file:
                return self._bag.source.read(header.data_position + position, size)
            return self._kept[1][position : position + size]

        return read
