"""A bag's connections and chunks, read from its index. Messages are not read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from pipros_tools.bag.connection import Connection, parse_connection
from pipros_tools.bag.errors import BagError, BagFormatError, NotIndexed, UnusableConnection
from pipros_tools.bag.index import (
    INDEX_RECORD_BYTES,
    ChunkHeader,
    ChunkInfo,
    parse_chunk_header,
    parse_chunk_info,
    parse_index,
)
from pipros_tools.bag.records import (
    BAG_HEADER_BYTES,
    ENTRY,
    HEADER_END,
    MAGIC,
    Fields,
    Op,
    Version,
    number,
    op_of,
    parse_fields,
    parse_version,
)
from pipros_tools.bag.source import Source

_LONGEST_FIRST_LINE = 100


@dataclass(slots=True)
class BagLayout:
    """A bag's connections and chunks.

    Attributes:
        version: format version.
        connections: connections by number, in file order.
        chunks: chunks in file order.
        indexes: packed index entries by chunk position, then by connection number, for bags in format 1.2 and
            bags whose index was rebuilt. For other bags, the entries are read from the file when needed.
        headers: chunk headers by position, if they were found by a scan.
        index_position: byte position of the index; 0 if there is none. Always 1 for bags in format 1.2.
        header_end: byte position after the file header.
        end: byte position after the last chunk.
        unusable: reasons by topic for connections whose header is damaged.
        damage: descriptions of the damage that a scan found.
    """

    version: Version
    connections: dict[int, Connection] = field(default_factory=dict)
    chunks: list[ChunkInfo] = field(default_factory=list)
    indexes: dict[int, Mapping[int, bytes]] = field(default_factory=dict)
    headers: dict[int, ChunkHeader] = field(default_factory=dict)
    index_position: int = 0
    header_end: int = HEADER_END
    end: int = 0
    unusable: dict[str, str] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)


_PACKED = (
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"\x1f\x8b", "gzip"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ", "xz"),
    (b"\x04\x22\x4d\x18", "lz4"),
    (b"PK\x03\x04", "zip"),
    (b"7z\xbc\xaf", "7-Zip"),
    (b"Rar!", "RAR"),
)
"""First bytes of files that other programs compressed as a whole."""

GIT_LFS = b"version https://git-lfs"
"""The first bytes of a file that stands for a file in Git's large file storage."""
IS_POINTER = "is not a bag, but a pointer of Git LFS; `git lfs pull` fetches the file itself"


def read_version(source: Source) -> tuple[Version, int]:
    """Return a bag's format version and the position of its first record.

    Raises:
        BagError: the file is empty or not a bag.
    """
    start = source.read(0, min(source.size, _LONGEST_FIRST_LINE))
    line, newline, _ = start.partition(b"\n")
    if not start:
        raise BagError(f"{source.name} is an empty file")
    if start.startswith(GIT_LFS):
        raise BagError(f"{source.name} {IS_POINTER}")
    version = parse_version(line) if newline else None
    if version is None:
        packed = next((name for magic, name in _PACKED if start.startswith(magic)), None)
        if packed:
            raise BagError(f"{source.name} is compressed with {packed}; decompress it first")
        raise BagError(f"{source.name} is not a bag: it must begin with {MAGIC.decode().strip()}")
    return version, len(line) + 1


def read_layout(source: Source, start: int) -> BagLayout:
    """Read the index of a format 2.0 bag whose first record starts at `start`.

    Raises:
        NotIndexed: the file header or the index is missing, truncated or damaged.
        BagFormatError: the index overlaps the file header.
        BagError: the bag is encrypted.
    """
    try:
        fields, data_position, data_size = source.header(start)
        where = source.at(start)
        if op_of(fields, where) != Op.FILE_HEADER:
            raise BagFormatError(f"{where}: the first record must be the file header")
        position = number(fields, "index_pos", 8, where)
        counts = number(fields, "conn_count", 4, where), number(fields, "chunk_count", 4, where)
    except BagFormatError as error:
        raise NotIndexed(f"{source.name} has no readable file header: {error}. {REPAIR}") from None
    check_not_encrypted(source, fields)
    if not position or (position >= source.size and counts != (0, 0)):
        reason = "has no index" if not position else "ends before its index"
        raise NotIndexed(f"{source.name} {reason}. {REPAIR}")
    layout = BagLayout(
        Version(2, 0), index_position=position, header_end=data_position + data_size, end=position
    )
    if position < layout.header_end:
        raise BagFormatError(f"{where}: the index must come after the file header, got position {position}")
    try:
        _read_index(source, layout, counts)
    except BagFormatError as error:
        raise NotIndexed(f"{source.name} has a damaged index: {error}. {REPAIR}") from None
    return layout


REPAIR = "Run rosbag reindex"


def check_not_encrypted(source: Source, fields: Fields) -> None:
    """Raise `BagError` if the fields of a bag's file header name an encryptor."""
    if fields.get("encryptor"):
        raise BagError(f"{source.name} is encrypted; pipros cannot read encrypted bags")


def _read_index(source: Source, layout: BagLayout, counts: tuple[int, int]) -> None:
    position = layout.index_position
    for wanted, count in zip((Op.CONNECTION, Op.CHUNK_INFO), counts, strict=True):
        for _ in range(count):
            fields, data_position, data_size = source.header(position)
            where = source.at(position)
            if (op := op_of(fields, where)) != wanted:
                raise BagFormatError(f"{where}: the record must be a {wanted.name} ({wanted:d}), got {op}")
            data = source.data(data_position, data_size)
            if wanted is Op.CONNECTION:
                try:
                    connection = parse_connection(fields, data, where)
                    layout.connections[connection.id] = connection
                except UnusableConnection as error:
                    layout.unusable[error.topic] = str(error)
            else:
                layout.chunks.append(parse_chunk_info(fields, data, where))
            position = data_position + data_size
    layout.chunks.sort(key=lambda chunk: chunk.position)
    where = source.at(layout.index_position)
    for chunk, following in pairwise(layout.chunks):
        if chunk.position == following.position:
            raise BagFormatError(f"{where}: the index lists the chunk at byte {chunk.position} twice")
    messages = sum(sum(chunk.counts.values()) for chunk in layout.chunks)
    if messages * ENTRY.size > source.size:
        raise BagFormatError(
            f"{where}: {messages} messages need {messages * ENTRY.size} bytes of entries, but the file has "
            f"{source.size}"
        )


def read_chunk_header(source: Source, layout: BagLayout, position: int) -> ChunkHeader:
    """Return the header of the chunk at `position`.

    Raises:
        BagFormatError: there is no chunk at this position.
    """
    if position in layout.headers:
        return layout.headers[position]
    fields, data_position, data_size = source.header(position)
    where = source.at(position)
    if (op := op_of(fields, where)) != Op.CHUNK:
        raise BagFormatError(f"{where}: the record must be a chunk, got op {op}")
    return parse_chunk_header(fields, data_position, data_size, where)


def read_chunk_index(
    source: Source, layout: BagLayout, chunk: ChunkInfo, header: ChunkHeader, end: int
) -> Mapping[int, bytes]:
    """Return a chunk's packed index entries by connection number.

    Args:
        end: byte position that the entries must not exceed, such as the position of the next chunk.

    Raises:
        BagFormatError: the chunk or its entries are damaged, or extend beyond `end`.
    """
    if chunk.position in layout.indexes:
        return layout.indexes[chunk.position]
    position = header.data_position + header.data_size
    expected = sum(INDEX_RECORD_BYTES + 12 * count for count in chunk.counts.values())
    block = _Block(source, position, min(expected, end - position))
    found: dict[int, bytes] = {}
    more: dict[int, list[bytes]] = {}
    for _ in chunk.counts:
        fields, data_position, data_size = block.header(position)
        where = source.at(position)
        if (op := op_of(fields, where)) != Op.INDEX:
            raise BagFormatError(f"{where}: the record must be an index, got op {op}")
        connection, entries = parse_index(fields, block.read(data_position, data_size), where)
        if connection in found:
            more.setdefault(connection, []).append(entries)
        else:
            found[connection] = entries
        position = data_position + data_size
    if position > end:
        # Without this check, nested chunks could share index records.
        raise BagFormatError(
            f"{source.at(chunk.position)}: the chunk must end before the next one, at byte {end}"
        )
    for connection, parts in more.items():
        found[connection] = b"".join([found[connection], *parts])
    return found


class _Block:
    """A buffered part of a source. Data beyond the buffer are read from the source."""

    def __init__(self, source: Source, position: int, size: int) -> None:
        self._source = source
        self._start = position
        self._bytes = source.read(position, max(0, min(size, source.size - position)))

    def header(self, position: int) -> tuple[dict[str, bytes], int, int]:
        begin = position - self._start
        size = int.from_bytes(self._bytes[begin : begin + 4], "little")
        end = begin + 8 + size
        if begin + 4 > len(self._bytes) or end > len(self._bytes) or size > BAG_HEADER_BYTES:
            return self._source.header(position)
        fields = parse_fields(self._bytes[begin + 4 : end - 4], self._source.at(position))
        return fields, self._start + end, int.from_bytes(self._bytes[end - 4 : end], "little")

    def read(self, position: int, size: int) -> bytes:
        begin = position - self._start
        if begin + size <= len(self._bytes):
            return self._bytes[begin : begin + size]
        return self._source.read(position, size)
