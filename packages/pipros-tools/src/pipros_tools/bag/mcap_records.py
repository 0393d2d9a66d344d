"""Read MCAP files in bounded memory: the summary, chunks at given positions, and their messages.

The `mcap` library parses schemas, channels, statistics and chunk indexes. This module reads everything else,
because the library limits neither the size of decompressed data nor the size of reads, and creates an object
for each message in a chunk.
"""

from __future__ import annotations

import zlib
from array import array
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from itertools import pairwise
from struct import Struct
from typing import Any, overload

from pipros_tools.bag.chunk_data import read_chunk_data, record_numbers, too_many_records
from pipros_tools.bag.compression import LZ4, NONE, ZSTD
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.runs import Entry
from pipros_tools.bag.source import Source

MAGIC = b"\x89MCAP0\r\n"

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 1, 2, 3, 4, 5, 6
CHUNK_INDEX, ATTACHMENT, STATISTICS, METADATA, DATA_END = 8, 9, 11, 12, 15

RECORD = Struct("<BQ")
MESSAGE_START = Struct("<HIQQ")
"""Layout of a message record's start: channel, sequence, log time and publish time."""

_CHUNK_START = Struct("<QQQII")
"""Layout of a chunk record's start.

The values are the first and last time (ns), uncompressed size, checksum, and length of the compression's
name.
"""

_FOOTER_AND_MAGIC = RECORD.size + 20 + len(MAGIC)
_COMPRESSIONS = {b"": NONE, b"lz4": LZ4, b"zstd": ZSTD}


class Entries(Sequence[Entry]):
    """Packed timestamps (ns) and offsets of a chunk's messages, in time order.

    All entries have rank 0; see `sorted_entries`.
    """

    def __init__(self, times: array[int], offsets: array[int]) -> None:
        order: Any = None
        if any(map(int.__gt__, times, times[1:])):
            order = sorted(range(len(times)), key=times.__getitem__)
        self.times = array("Q", map(times.__getitem__, order)) if order else times
        self.offsets = array("Q", map(offsets.__getitem__, order)) if order else offsets

    def __len__(self) -> int:
        return len(self.times)

    @overload
    def __getitem__(self, at: int) -> Entry: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[Entry]: ...
    def __getitem__(self, at: int | slice) -> Entry | Sequence[Entry]:
        if isinstance(at, slice):
            return Entries(self.times[at], self.offsets[at])
        return self.times[at], 0, self.offsets[at]


@dataclass(frozen=True, slots=True)
class McapChunk:
    """Description of a chunk, read from its record.

    Times are in ns. A checksum of 0 means that there is none.
    """

    start: int
    end: int
    checksum: int
    header: ChunkHeader


@dataclass(slots=True)
class McapSummary:
    """Summary of a file, consisting of the `mcap` library's records. Chunk indexes are sorted by position."""

    statistics: Any = None
    schemas: dict[int, Any] = field(default_factory=dict)
    channels: dict[int, Any] = field(default_factory=dict)
    chunk_indexes: list[Any] = field(default_factory=list)


def parsed(kind: Any, data: bytes) -> Any:
    """Parse a record with the `mcap` library. Raise the library's errors if the record is damaged."""
    from mcap.data_stream import ReadDataStream

    return kind.read(ReadDataStream(BytesIO(data)))


def read_summary(source: Source) -> McapSummary | None:
    """Return the summary of a file, or None if it does not have one.

    Raises:
        BagFormatError: the file does not end with a footer, or the summary is truncated or lists a chunk
            twice. Damaged records raise the library's errors.
    """
    from mcap.records import Channel, ChunkIndex, Schema, Statistics

    at = source.size - _FOOTER_AND_MAGIC
    op, size = RECORD.unpack(source.read(max(at, 0), RECORD.size))
    if (op, size) != (FOOTER, 20) or source.read(source.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise BagFormatError(f"{source.at(max(at, 0))}: the file must end with a footer")
    start = int.from_bytes(source.read(at + RECORD.size, 8), "little")
    if not start:
        return None
    summary = McapSummary()
    for op, position, size in records(source, start):
        if op == FOOTER:
            break
        if op not in (SCHEMA, CHANNEL, CHUNK_INDEX, STATISTICS):
            continue
        data = source.data(position, size)
        if op == SCHEMA:
            schema = parsed(Schema, data)
            summary.schemas[schema.id] = schema
        elif op == CHANNEL:
            channel = parsed(Channel, data)
            summary.channels[channel.id] = channel
        elif op == STATISTICS:
            summary.statistics = parsed(Statistics, data)
        else:
            summary.chunk_indexes.append(parsed(ChunkIndex, data))
    positions = sorted(chunk.chunk_start_offset for chunk in summary.chunk_indexes)
    for position, following in pairwise(positions):
        if position == following:
            raise BagFormatError(f"{source.at(start)}: the summary lists the chunk at byte {position} twice")
    summary.chunk_indexes.sort(key=lambda chunk: chunk.chunk_start_offset)
    return summary


def read_profile(source: Source) -> str:
    """Return the profile in a file's header. Damaged records raise the library's errors."""
    from mcap.records import Header

    op, position, size = next(records(source, len(MAGIC)))
    return str(parsed(Header, source.data(position, size)).profile) if op == HEADER else ""


def records(source: Source, position: int) -> Iterator[tuple[int, int, int]]:
    """Yield the kind, content position and content size of each record, starting at `position`.

    The caller must stop at the last record.

    Raises:
        BagFormatError: there are no more records, or the file ends within a record's opcode or length.
    """
    while True:
        op, size = RECORD.unpack(source.read(position, RECORD.size))
        position += RECORD.size
        yield op, position, size
        position += size


def records_in(data: bytes | bytearray, where: str, numbers: Iterator[int]) -> Iterator[tuple[int, int, int]]:
    """Yield the kind, position and size of each record in a chunk's content; see `records`.

    Args:
        numbers: see `record_numbers`.
    """
    position, end = 0, len(data)
    for _ in numbers:
        if position == end:
            return
        after = position + RECORD.size
        if after <= end:
            op, size = RECORD.unpack_from(data, position)
            position = after + size
        if after > end or position > end or (op == MESSAGE and size < MESSAGE_START.size):
            raise BagFormatError(f"{where}: the record at byte {after - RECORD.size} of the chunk is damaged")
        yield op, after, size
    raise too_many_records(where)


def read_chunk(source: Source, position: int) -> McapChunk:
    """Return the description of the chunk whose record is at `position`.

    Raises:
        BagFormatError: there is no chunk at this position, or its record is damaged.
    """
    where = source.at(position)
    op, size = RECORD.unpack(source.read(position, RECORD.size))
    if op != CHUNK or size < _CHUNK_START.size + 8:
        raise BagFormatError(f"{where}: the record must be a chunk, got record {op} of {size} bytes")
    position += RECORD.size
    start, end, plain_size, checksum, length = _CHUNK_START.unpack(source.read(position, _CHUNK_START.size))
    position += _CHUNK_START.size
    name = source.read(position, min(length, 8))
    if name not in _COMPRESSIONS or len(name) != length:
        raise BagFormatError(
            f"{where}: compression must be empty, lz4 or zstd, got [{name.decode('utf-8', 'replace')}]"
        )
    data_size = int.from_bytes(source.read(position + length, 8), "little")
    if data_size > size - _CHUNK_START.size - length - 8:
        raise BagFormatError(f"{where}: {data_size} bytes of data do not fit into a record of {size} bytes")
    header = ChunkHeader(_COMPRESSIONS[name], position + length + 8, data_size, plain_size)
    return McapChunk(start, end, checksum, header)


def check_content(source: Source, chunk: McapChunk, data: bytes | bytearray) -> None:
    """Raise `BagFormatError` if the content of a chunk does not match its checksum."""
    if chunk.checksum and zlib.crc32(data) != chunk.checksum:
        where = source.at(chunk.header.data_position)
        raise BagFormatError(f"{where}: the chunk is damaged: its checksum is wrong")


def message_entries(
    data: bytes | bytearray,
    where: str,
    wanted: Container[int],
    first: int,
    last: int,
    numbers: Iterator[int],
) -> Entries:
    """Return the entries of messages on the selected channels between two timestamps (ns), inclusive.

    Raises:
        BagFormatError: a record is damaged, or there are too many; see `record_numbers`.
    """
    times, offsets = array("Q"), array("Q")
    unpack = MESSAGE_START.unpack_from
    for op, position, _ in records_in(data, where, numbers):
        if op == MESSAGE:
            channel, _, time, _ = unpack(data, position)
            if channel in wanted and first <= time <= last:
                times.append(time)
                offsets.append(position - RECORD.size)
    return Entries(times, offsets)


def all_records(
    source: Source,
    progress: Callable[[int], object],
    on_damage: Callable[[str], object],
) -> Iterator[tuple[int, bytes]]:
    """Yield the kind and content of each header, schema, channel, message, metadata and attachment record.

    The summary is not needed. If the content of a chunk is damaged, `on_damage` is called with a description,
    and the records after the chunk follow.

    Raises:
        BagFormatError: the file is not MCAP or is truncated, or a record outside of chunks is damaged.
    """
    if source.read(0, min(source.size, len(MAGIC))) != MAGIC:
        raise BagFormatError(f"{source.name} is not an MCAP file")
    numbers = record_numbers(source)
    for op, position, size in records(source, len(MAGIC)):
        progress(position)
        if op == CHUNK:
            source.read(position + size - 1, min(size, 1))  # the file ends within a truncated chunk
            try:
                chunk = read_chunk(source, position - RECORD.size)
                data = read_chunk_data(source, chunk.header)
                check_content(source, chunk, data)
                for inner, at, length in records_in(data, source.at(position), numbers):
                    if inner in (SCHEMA, CHANNEL, MESSAGE):
                        yield inner, data[at : at + length]
            except BagFormatError as error:
                on_damage(str(error))
        elif op in (HEADER, SCHEMA, CHANNEL, METADATA):
            yield op, source.data(position, size)
        elif op in (MESSAGE, ATTACHMENT):
            yield op, source.read(position, size)
        elif op == DATA_END:
            return
