"""The records of MCAP files in bounded memory: single chunks by position, and whole files without a summary.

The `mcap` library parses the records. It neither bounds decompression by the size that a chunk claims, nor
reads by the size of the file; this module does.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

from pipros.bag.compression import LZ4, decompress
from pipros.bag.errors import BagFormatError
from pipros.bag.source import Source
from pipros.limits import Limits

_RECORD_START = 9
"""Bytes of a record's code and length."""


class ClampedFile:
    """A file that never reads more than what is left of it, whatever a damaged length says."""

    def __init__(self, source: Source, file: Any) -> None:
        self._source, self._file = source, file

    def read(self, size: int = -1, /) -> bytes:
        left = max(0, self._source.size - self._file.tell())
        data: bytes = self._file.read(left if size < 0 else min(size, left))
        return data

    def seek(self, offset: int, whence: int = 0, /) -> int:
        return int(self._file.seek(offset, whence))

    def tell(self) -> int:
        return int(self._file.tell())

    def seekable(self) -> bool:
        return True


def read_chunk(source: Source, position: int, limits: Limits) -> list[Any]:
    """The records of the chunk at a position: schemas, channels and messages.

    Raises:
        BagFormatError: there is no chunk, or it is damaged or too large.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.opcode import Opcode
    from mcap.records import Chunk

    where = source.at(position)
    start = source.read(position, _RECORD_START)
    size = int.from_bytes(start[1:], "little")
    if start[0] != Opcode.CHUNK or size > limits.bag_chunk_bytes:
        raise BagFormatError(
            f"{where}: a chunk of at most {limits.bag_chunk_bytes} bytes (bag_chunk_bytes) is expected, "
            f"got the record {start[0]} of {size} bytes"
        )
    chunk = Chunk.read(ReadDataStream(BytesIO(source.read(position + _RECORD_START, size))))
    return chunk_records(chunk, where, limits)


def chunk_records(chunk: Any, where: str, limits: Limits) -> list[Any]:
    """The records in a chunk. Raises `BagFormatError` if it is damaged or too large."""
    from mcap.records import Chunk
    from mcap.stream_reader import breakup_chunk

    if chunk.uncompressed_size > limits.bag_chunk_bytes:
        raise BagFormatError(
            f"{where}: a chunk must have at most {limits.bag_chunk_bytes} bytes (bag_chunk_bytes), got "
            f"{chunk.uncompressed_size}"
        )
    if chunk.compression == "zstd":
        data = _decompress_zstd(chunk.data, chunk.uncompressed_size, where)
    elif chunk.compression == "lz4":
        data = decompress(LZ4, chunk.data, chunk.uncompressed_size, where)
    elif chunk.compression:
        raise BagFormatError(f"{where}: the compression must be lz4 or zstd, got [{chunk.compression}]")
    else:
        data = chunk.data
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise BagFormatError(f"{where}: the chunk is damaged: its checksum differs")
    plain = Chunk("", data, chunk.message_end_time, chunk.message_start_time, 0, len(data))
    return breakup_chunk(plain)


def _decompress_zstd(data: bytes, size: int, where: str) -> bytes:
    import zstandard

    claimed = zstandard.get_frame_parameters(data).content_size
    if claimed not in (size, zstandard.CONTENTSIZE_UNKNOWN):
        raise BagFormatError(f"{where}: the chunk must have {size} bytes, got {claimed}")
    plain: bytes = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    return plain


def all_records(
    source: Source, file: Any, limits: Limits, progress: Callable[[int], object]
) -> Iterator[Any]:
    """The schemas, channels and messages of a file from its start, without its summary.

    At the first damaged place it raises what the library raises there, or `BagFormatError`.
    """
    from mcap.records import Channel, Chunk, DataEnd, Message, Schema
    from mcap.stream_reader import StreamReader

    file.seek(0)
    clamped: Any = ClampedFile(source, file)
    reader = StreamReader(clamped, emit_chunks=True, record_size_limit=limits.bag_chunk_bytes)
    for record in reader.records:
        progress(file.tell())
        if isinstance(record, Chunk):
            yield from chunk_records(record, source.at(file.tell()), limits)
        elif isinstance(record, Schema | Channel | Message):
            yield record
        elif isinstance(record, DataEnd):
            return
