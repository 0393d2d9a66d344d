"""Build the index of a damaged or unindexed bag in format 2.0 by scanning the file.

In each chunk, all messages before the first damage are found, even if the chunk is incomplete because the
writer was killed. A compressed chunk that cannot be decompressed is skipped. After damage, the scan continues
at the next chunk.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace

from pipros_tools.bag.chunk_data import read_chunk_data, record_numbers, too_many_records
from pipros_tools.bag.connection import Connection, parse_connection
from pipros_tools.bag.errors import BagFormatError, UnusableConnection
from pipros_tools.bag.index import ChunkHeader, ChunkInfo, parse_chunk_header
from pipros_tools.bag.layout import BagLayout, check_not_encrypted
from pipros_tools.bag.records import (
    BAG_HEADER_BYTES,
    ENTRY,
    Op,
    Version,
    entry_bytes,
    number,
    op_of,
    parse_entries,
    parse_fields,
    time_of,
)
from pipros_tools.bag.source import Source

_CHUNK_STARTS = re.compile(rb"\x04\0\0\0op=\x05|....compression=", re.DOTALL)
_SEARCH_BYTES = 1024 * 1024

Progress = Callable[[int], None]


@dataclass(slots=True)
class Contents:
    """Connections and index entries found in one chunk, and the errors of unusable connections.

    `size` is the number of bytes before the first damaged or truncated record.
    """

    connections: list[Connection] = field(default_factory=list)
    unusable: list[UnusableConnection] = field(default_factory=list)
    entries: dict[int, bytearray] = field(default_factory=dict)
    start_ns: int | None = None
    end_ns: int = 0
    size: int = 0

    def add(self, connection: int, time_ns: int, offset: int) -> None:
        self.entries.setdefault(connection, bytearray()).extend(entry_bytes(time_ns, offset))
        self.start_ns = time_ns if self.start_ns is None else min(self.start_ns, time_ns)
        self.end_ns = max(self.end_ns, time_ns)

    def forget(self, offset: int) -> None:
        """Remove the last record, at `offset`, if it is a message."""
        end = offset.to_bytes(4, "little")
        for connection, entries in list(self.entries.items()):
            if entries.endswith(end):
                del entries[-ENTRY.size :]
                self.size = offset
                if not entries:
                    del self.entries[connection]
        times = [time for data in self.entries.values() for time, _, _ in parse_entries(bytes(data))]
        self.start_ns, self.end_ns = min(times, default=None), max(times, default=0)


def scan(source: Source, start: int, progress: Progress | None = None) -> BagLayout:
    """Return the connections and chunks of a bag whose first record starts at `start`.

    `progress` is called before each record, with the record's byte position. `BagLayout.damage` describes any
    damage.

    Raises:
        BagError: the bag is encrypted.
    """
    with suppress(BagFormatError):
        check_not_encrypted(source, source.header(start)[0])
    layout = BagLayout(Version(2, 0), end=start)
    position, numbers = start, record_numbers(source)
    while position < source.size:
        if progress is not None:
            progress(position)
        try:
            position = _scan_record(source, layout, position, numbers)
        except BagFormatError as error:
            layout.damage.append(str(error))
            position = _next_chunk(source, position + 1)
    return layout


def _scan_record(source: Source, layout: BagLayout, position: int, numbers: Iterator[int]) -> int:
    """Add the contents of the record at `position` to the layout. Return the position of the next record."""
    fields, data_position, data_size = source.header(position)
    where = source.at(position)
    op = op_of(fields, where)
    after = data_position + data_size
    if op == Op.CHUNK:
        header = parse_chunk_header(fields, data_position, data_size, where)
        if header.compression == "none" and (not data_size or after > source.size):
            # The writer was killed before it wrote the size or the entire chunk.
            header = replace(header, data_size=source.size - data_position, size=source.size - data_position)
            return _scan_open_chunk(source, layout, position, header, numbers)
        try:
            contents = _read_chunk(source, header, numbers)
        except BagFormatError as error:
            if after > source.size:
                raise
            layout.damage.append(str(error))
            return after
        add_chunk(layout, position, header, contents)
        if contents.size < header.size:
            layout.damage.append(f"{where}: the chunk is damaged after byte {contents.size} of its content")
        layout.end = after
    elif op == Op.MESSAGE:
        is_cut = after > source.size  # in a chunk that was not finished
        raise BagFormatError(
            f"{where}: the last message is cut off" if is_cut else f"{where}: a message must be in a chunk"
        )
    elif op == Op.CONNECTION:
        try:
            connection = parse_connection(fields, source.data(data_position, data_size), where)
            layout.connections.setdefault(connection.id, connection)
        except UnusableConnection as error:
            _add_unusable(layout, error)
    elif op in (Op.INDEX, Op.CHUNK_INFO, Op.FILE_HEADER):
        if after > source.size:
            raise BagFormatError(f"{where}: the record must end within the file, but it ends at byte {after}")
        if op != Op.CHUNK_INFO:
            layout.end = after
    else:
        raise BagFormatError(f"{where}: the op {op} is unknown")
    return after


def _read_chunk(source: Source, header: ChunkHeader, numbers: Iterator[int]) -> Contents:
    if header.compression == "none" and header.size == header.data_size:
        start = header.data_position
        return _walk(lambda at, size: source.read(start + at, size), header.size, source.at(start), numbers)
    data = read_chunk_data(source, header)
    where = source.at(header.data_position)
    return _walk(lambda at, size: data[at : at + size], len(data), where, numbers)


def _scan_open_chunk(
    source: Source, layout: BagLayout, position: int, header: ChunkHeader, numbers: Iterator[int]
) -> int:
    start = header.data_position
    contents = _walk(lambda at, size: source.read(start + at, size), header.size, source.at(start), numbers)
    header = replace(header, data_size=contents.size, size=contents.size)
    if contents.entries:
        layout.headers[position] = header
        add_chunk(layout, position, header, contents)
        layout.damage.append(
            f"{source.at(position)}: the chunk was not finished; its complete messages are kept"
        )
    after = start + contents.size
    layout.end = after
    return after if contents.entries or contents.size else start


def add_chunk(layout: BagLayout, position: int, header: ChunkHeader, contents: Contents) -> None:
    """Add a chunk's connections and, unless the chunk has no messages, the chunk and its index."""
    for error in contents.unusable:
        _add_unusable(layout, error)
    for connection in contents.connections:
        layout.connections.setdefault(connection.id, connection)
    if contents.start_ns is None:
        return
    counts = {connection: len(data) // ENTRY.size for connection, data in contents.entries.items()}
    layout.chunks.append(ChunkInfo(position, contents.start_ns, contents.end_ns, counts))
    layout.indexes[position] = {connection: bytes(data) for connection, data in contents.entries.items()}
    layout.headers[position] = header


def _add_unusable(layout: BagLayout, error: UnusableConnection) -> None:
    if error.topic not in layout.unusable:
        layout.unusable[error.topic] = str(error)
        layout.damage.append(f"{error.topic} is left out: {error}")


def _walk(read: Callable[[int, int], bytes], size: int, place: str, numbers: Iterator[int]) -> Contents:
    """Return the connections and messages in a chunk before the first damaged or truncated record.

    Raises:
        BagFormatError: there are too many records; see `record_numbers`.
    """
    contents = Contents()
    position = last = 0
    is_empty = False
    while position < size:
        if next(numbers, None) is None:
            raise too_many_records(place)
        head = read(position, min(128, size - position))
        if is_empty and not any(head[:8]):
            contents.forget(last)  # after a power failure, the length of the last message was not written
            break
        if len(head) < 8:
            break
        header_size = int.from_bytes(head[:4], "little")
        if header_size > min(size - position - 8, BAG_HEADER_BYTES):
            break
        if header_size + 8 > len(head):
            head = read(position, header_size + 8)
        data_size = int.from_bytes(head[4 + header_size : 8 + header_size], "little")
        after = position + 8 + header_size + data_size
        if after > size:
            break
        try:
            _scan_inner(contents, head[4 : 4 + header_size], position, after - data_size, data_size, read)
        except BagFormatError:
            break
        last, position, is_empty = position, after, not data_size
        contents.size = after
    return contents


def _scan_inner(
    contents: Contents,
    header: bytes,
    offset: int,
    data_position: int,
    data_size: int,
    read: Callable[[int, int], bytes],
) -> None:
    where = f"byte {offset} of the chunk"
    fields = parse_fields(header, where)
    op = op_of(fields, where)
    if op == Op.MESSAGE:
        contents.add(number(fields, "conn", 4, where), time_of(fields, "time", where), offset)
    elif op == Op.CONNECTION:
        try:
            contents.connections.append(parse_connection(fields, read(data_position, data_size), where))
        except UnusableConnection as error:
            contents.unusable.append(error)
    else:
        raise BagFormatError(f"{where}: a chunk cannot contain a record with op {op}")


def _next_chunk(source: Source, position: int) -> int:
    """Return the position of the next likely chunk, or the end of the file if there is none."""
    first = position
    while position < source.size:
        block = source.read(position, min(_SEARCH_BYTES, source.size - position))
        for match in _CHUNK_STARTS.finditer(block):
            candidate = position + match.start() - 4
            if candidate < first:
                continue
            try:
                fields, _, _ = source.header(candidate)
                if op_of(fields, "") == Op.CHUNK and "compression" in fields and "size" in fields:
                    return candidate
            except BagFormatError:
                continue
        if len(block) < _SEARCH_BYTES:
            break
        position += len(block) - 64
    return source.size
