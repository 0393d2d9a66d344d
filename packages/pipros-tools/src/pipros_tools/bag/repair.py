"""Rebuild, in place, the index of a bag that is truncated or damaged, or whose writer was killed.

The leading chunks that are complete and followed by their index stay unchanged. All readable messages after
them are rewritten.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from typing import Any

from pipros_tools.bag.chunk_data import read_chunk_data
from pipros_tools.bag.compression import NONE
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, index_record
from pipros_tools.bag.layout import BagLayout, read_chunk_header, read_chunk_index, read_version
from pipros_tools.bag.records import HEADER_END, LEAST_HEADER_END, Version
from pipros_tools.bag.scan import Progress, scan
from pipros_tools.bag.source import Source
from pipros_tools.bag.writer import BagWriter

_IN_MEMORY_BYTES = 64 * 1024 * 1024


def reindex(file: Any, name: str, progress: Progress | None = None) -> BagWriter:
    """Repair a bag, and return a writer that can add messages. The writer's `finish` writes the index.

    Args:
        file: a binary file open for reading and writing.

    Raises:
        BagError: the file is not a bag in format 2.0.
    """
    source = Source(file, name)
    version, start = read_version(source)
    if version.number != 200:
        raise BagFormatError(f"{name}: only bags in format 2.0 can be indexed")
    found = scan(source, start, progress)
    header_end = _after_file_header(source, start)
    kept = BagLayout(Version(2, 0), connections=found.connections, header_end=header_end, end=header_end)
    rest = list(found.chunks)
    while rest and (end := _end_if_whole(source, found, rest[0])) and rest[0].position == kept.end:
        kept.chunks.append(rest.pop(0))
        kept.end = end
    with tempfile.SpooledTemporaryFile(_IN_MEMORY_BYTES) as spool:
        sizes = [len_written(spool, _rewritten(source, found, chunk)) for chunk in rest]
        writer = BagWriter(file, layout=kept)
        spool.seek(0)
        file.seek(kept.end)
        for chunk, size in zip(rest, sizes, strict=True):
            kept.chunks.append(ChunkInfo(kept.end, chunk.start_ns, chunk.end_ns, chunk.counts))
            kept.end += size
        shutil.copyfileobj(spool, file)
        file.flush()
    kept.damage = found.damage
    return writer


def len_written(spool: Any, parts: Iterator[bytes]) -> int:
    """Write all parts. Return their total size in bytes."""
    return sum(spool.write(part) for part in parts)


def _after_file_header(source: Source, start: int) -> int:
    """Return the position after the file header, or after a new one if this one cannot be changed."""
    try:
        _, data_position, data_size = source.header(start)
    except BagFormatError:
        return HEADER_END
    end = data_position + data_size
    return end if LEAST_HEADER_END <= end <= source.size else HEADER_END


def _end_if_whole(source: Source, found: BagLayout, chunk: ChunkInfo) -> int:
    """Return the end of a chunk and its index, or 0 if the index does not match the chunk's messages."""
    bare = BagLayout(found.version)
    try:
        header = read_chunk_header(source, bare, chunk.position)
        index = read_chunk_index(source, bare, chunk, header, source.size)
    except BagFormatError:
        return 0
    if header != found.headers[chunk.position] or index.keys() != chunk.counts.keys():
        return 0
    rebuilt = found.indexes[chunk.position]
    if any(sorted(_entries(index[key])) != sorted(_entries(rebuilt[key])) for key in rebuilt):
        return 0
    size = sum(len(index_record(key, data)) for key, data in index.items())
    return header.data_position + header.data_size + size


def _entries(data: bytes) -> list[bytes]:
    return [data[at : at + 12] for at in range(0, len(data), 12)]


def _rewritten(source: Source, found: BagLayout, chunk: ChunkInfo) -> Iterator[bytes]:
    """Yield the bytes of a chunk record and of its index records."""
    header = found.headers[chunk.position]
    if header.compression == NONE:
        data = source.read(header.data_position, header.data_size)
        yield chunk_header_bytes(NONE, len(data), len(data))
    else:
        read_chunk_data(source, header)
        data = source.read(header.data_position, header.data_size)
        yield chunk_header_bytes(header.compression, header.size, header.data_size)
    yield data
    for connection, entries in found.indexes[chunk.position].items():
        yield index_record(connection, entries)
