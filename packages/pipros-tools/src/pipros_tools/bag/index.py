"""The index of a bag in format 2.0: the messages of each connection, and the contents of each chunk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.records import (
    ENTRY,
    TIME,
    U32,
    U64,
    Fields,
    Op,
    number,
    record_bytes,
    text_of,
    time_bytes,
    time_of,
)

INDEX_RECORD_BYTES = 55
"""Size in bytes of an index record without its entries, in the files of all known writers."""


@dataclass(frozen=True, slots=True)
class ChunkInfo:
    """Index entry of a chunk.

    Attributes:
        position: byte position of the chunk's record in the file.
        start_ns, end_ns: timestamps of the earliest and latest message.
        counts: number of messages by connection number.
    """

    position: int
    start_ns: int
    end_ns: int
    counts: Mapping[int, int]


@dataclass(frozen=True, slots=True)
class ChunkHeader:
    """The header of a chunk record.

    Attributes:
        compression: `none`, `bz2` or `lz4`; in MCAP files, `none`, `lz4` or `zstd`.
        data_position, data_size: position and size of the compressed data in the file, in bytes.
        size: uncompressed size in bytes.
    """

    compression: str
    data_position: int
    data_size: int
    size: int


def parse_chunk_header(fields: Fields, data_position: int, data_size: int, where: str) -> ChunkHeader:
    """Parse a chunk header from the fields of its record.

    Raises:
        BagFormatError: the size or the compression is missing.
    """
    if "compression" not in fields:
        raise BagFormatError(f"{where}: the field [compression] is missing")
    size = number(fields, "size", 4, where)
    return ChunkHeader(text_of(fields["compression"]), data_position, data_size, size)


def chunk_header_bytes(compression: str, size: int, data_size: int) -> bytes:
    """Return the start of a chunk record, up to its data."""
    fields = {"op": bytes([Op.CHUNK]), "compression": compression.encode(), "size": U32.pack(size)}
    return record_bytes(fields, b"")[:-4] + U32.pack(data_size)


def parse_index(fields: Fields, data: bytes, where: str) -> tuple[int, bytes]:
    """Return a connection's number and its entries in one chunk, packed as `ENTRY`.

    Raises:
        BagFormatError: a field is missing, the version is not 1, or the size does not match the number of
            entries.
    """
    version = number(fields, "ver", 4, where)
    if version != 1:
        raise BagFormatError(f"{where}: index version must be 1, got {version}")
    count = number(fields, "count", 4, where)
    if len(data) != count * ENTRY.size:
        raise BagFormatError(f"{where}: {count} entries need {count * ENTRY.size} bytes, got {len(data)}")
    return number(fields, "conn", 4, where), data


def index_record(connection: int, entries: bytes) -> bytes:
    """Return the index record for one connection in one chunk."""
    fields = {
        "op": bytes([Op.INDEX]),
        "conn": U32.pack(connection),
        "ver": U32.pack(1),
        "count": U32.pack(len(entries) // ENTRY.size),
    }
    return record_bytes(fields, entries)


def parse_chunk_info(fields: Fields, data: bytes, where: str) -> ChunkInfo:
    """Parse a chunk info record.

    Raises:
        BagFormatError: a field is missing, the version is not 1, or the size does not match the number of
            connections.
    """
    version = number(fields, "ver", 4, where)
    if version != 1:
        raise BagFormatError(f"{where}: chunk info version must be 1, got {version}")
    count = number(fields, "count", 4, where)
    if len(data) != count * TIME.size:
        raise BagFormatError(f"{where}: {count} connections need {count * TIME.size} bytes, got {len(data)}")
    return ChunkInfo(
        number(fields, "chunk_pos", 8, where),
        time_of(fields, "start_time", where),
        time_of(fields, "end_time", where),
        dict(_pairs(data)),
    )


def chunk_info_record(info: ChunkInfo) -> bytes:
    """Return the chunk info record for one chunk."""
    fields = {
        "op": bytes([Op.CHUNK_INFO]),
        "ver": U32.pack(1),
        "chunk_pos": U64.pack(info.position),
        "start_time": time_bytes(info.start_ns),
        "end_time": time_bytes(info.end_ns),
        "count": U32.pack(len(info.counts)),
    }
    return record_bytes(fields, b"".join(TIME.pack(*pair) for pair in info.counts.items()))


def _pairs(data: bytes) -> Iterator[tuple[int, int]]:
    yield from TIME.iter_unpack(data)
