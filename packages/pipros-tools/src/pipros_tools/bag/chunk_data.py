"""Cache of chunk contents. A thread pool decompresses bz2 and zstd chunks in advance."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol

from pipros.basics.limits import Limits
from pipros_tools.bag.compression import BZ2, NONE, ZSTD, decompress
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.source import Source

BAG_CHUNK_BYTES = 2048 * 1024 * 1024
"""Limit: one chunk of a bag, uncompressed. Beyond it, the chunk is refused, with its position; no chunk is
decompressed beyond the size that it claims.
"""
BAG_EXPANDED_BYTES = 128 * 1024 * 1024
"""Limit: one chunk of a bag, uncompressed, if it is more than 64 times as large as the compressed chunk.
Beyond it, a chunk that expands more than 64-fold is refused, with its position.
"""
BAG_RECORDS = 1024 * 1024
"""Limit: records that are found by reading the chunks of a bag or MCAP file, in addition to one for each byte
of the file. Beyond it, the chunk is refused, with its position.
"""

LARGE_BYTES = 16 * 1024 * 1024
"""Size above which uncompressed chunks are not cached. Their messages are read from the file one by one."""

_ORDINARY_RATIO = 64
"""Maximum expansion ratio of ordinary messages. Only large blank images and maps exceed it.

lz4 reaches 255, bz2 and zstd any ratio, so that a higher limit would let files fill the memory.
"""

VIEW_BYTES = 64 * 1024
"""Size of a message, or mean size in a chunk, above which messages are decoded without a copy."""

_SLOW = {BZ2, ZSTD}
"""Compressions whose chunks are decompressed in threads.

For lz4, threads would not save time. Allocating a chunk's memory takes longer than decompressing the chunk,
and twice as long in a thread, whose heap returns the memory to the system: reading a 0.9 MB image took
1,550 us of processor time instead of 700.
"""

_AHEAD_BYTES = 64 * 1024 * 1024
"""Maximum total uncompressed size of the chunks that one call of `ChunkStore.get` starts to read ahead."""


class ChunkHeaders(Protocol):
    """Callable that takes a chunk's number and returns the chunk's header."""

    def __call__(self, number: int, /) -> ChunkHeader: ...


def read_chunk_data(source: Source, header: ChunkHeader) -> bytes:
    """Return the entire content of a chunk.

    Raises:
        BagFormatError: the chunk is truncated, damaged or larger than allowed.
    """
    where = check_chunk(source, header)
    data = source.read(header.data_position, header.data_size)
    return decompress(header.compression, data, header.size, where)


@contextmanager
def with_advice() -> Iterator[None]:
    """Context manager that adds to an error about a damaged chunk what to try."""
    try:
        yield
    except BagFormatError as error:
        raise BagFormatError(f"{error}. Try rosbag reindex, which leaves out the chunk") from None


def are_large(size: int, count: int) -> bool:
    """Return whether to decode `count` messages in a chunk of `size` bytes without copying them.

    The allocator returns large blocks to the system, so each copy of a large message causes page faults.
    Reading a 0.9 MB image took 700 us with a copy, and 230 us as a view of a reused buffer.
    """
    return size > count * VIEW_BYTES


def check_chunk(source: Source, header: ChunkHeader) -> str:
    """Check the size of a chunk against the limits, and return its location for error messages.

    Raises:
        BagFormatError: the chunk is larger than allowed.
    """
    where = f"{source.at(header.data_position)}, a chunk"
    if header.size > BAG_CHUNK_BYTES:
        raise BagFormatError(f"{where}: its size must be at most {BAG_CHUNK_BYTES} bytes, got {header.size}")
    if BAG_EXPANDED_BYTES < header.size > _ORDINARY_RATIO * header.data_size:
        raise BagFormatError(
            f"{where}: its {header.data_size} bytes expand to {header.size}, over {_ORDINARY_RATIO} times "
            f"as many; the limit is {BAG_EXPANDED_BYTES} bytes"
        )
    return where


def record_numbers(source: Source) -> Iterator[int]:
    """Return the numbers of records, of which a walk over the chunks of a file takes one for each record.

    Without a limit, 11 KB cost as much time as the four million records that they expand to. The densest
    messages, empty ones at a constant rate, take 3 bytes in chunks of zstd, and 0.5 bytes beside 12 bytes of
    index in bags.
    """
    return iter(range(BAG_RECORDS + source.size))


def too_many_records(where: str) -> BagFormatError:
    """Return the error for a chunk for whose records there is no number left; see `record_numbers`."""
    return BagFormatError(
        f"{where}: the file's chunks have too many records; the limit is {BAG_RECORDS}, and one more for "
        "each byte of the file"
    )


class ChunkStore:
    """Cache of chunk contents. A thread pool decompresses upcoming chunks if their format is slow.

    The size of the cache is at most `bag_cache_bytes`, plus the chunk in use and the chunks that are read
    ahead.
    """

    def __init__(self, source: Source, headers: ChunkHeaders, limits: Limits) -> None:
        self._source = source
        self._headers = headers
        self._limits = limits
        self._kept: OrderedDict[int, bytes | bytearray] = OrderedDict()
        self._spare = bytearray()
        self._kept_bytes = 0
        self._ahead: dict[int, Future[bytes]] = {}
        self._threads: ThreadPoolExecutor | None = None
        processors = os.cpu_count() or 1  # called once per cache, because it reads a system file
        self._threads_limit = processors if processors > 1 else 0

    def get(
        self, number: int, upcoming: Sequence[int] = (), *, is_reusable: bool = False
    ) -> bytes | bytearray | None:
        """Return the content of a chunk.

        Return None for a large uncompressed chunk, whose messages must be read from the file.

        Args:
            upcoming: the numbers of the chunks that will be requested next.
            is_reusable: whether another chunk may overwrite the content after `drop`.

        Raises:
            BagFormatError: the chunk is damaged.
        """
        data = self._kept.get(number)
        if data is not None:
            self._kept.move_to_end(number)
            return data
        header = self._headers(number)
        if header.compression == NONE and header.data_size == header.size > LARGE_BYTES:
            return None
        self._prepare(upcoming)
        if number in self._ahead:
            with with_advice():
                data = self._ahead.pop(number).result()
        elif is_reusable and header.compression == NONE and header.data_size == header.size:
            check_chunk(self._source, header)
            data = self._spare if len(self._spare) == header.size else bytearray(header.size)
            self._spare = bytearray()
            self._source.read_into(data, header.data_position)
        else:
            check_chunk(self._source, header)
            with with_advice():
                data = read_chunk_data(self._source, header)
        self._keep(number, data)
        return data

    def drop(self, number: int) -> None:
        """Discard a chunk that is no longer needed."""
        self._ahead.pop(number, None)
        data = self._kept.pop(number, b"")
        self._kept_bytes -= len(data)
        if isinstance(data, bytearray):
            self._spare = data

    def close(self) -> None:
        """Stop the thread pool."""
        self._ahead.clear()
        if self._threads is not None:
            self._threads.shutdown(wait=True, cancel_futures=True)
            self._threads = None

    def _keep(self, number: int, data: bytes | bytearray) -> None:
        self._kept[number] = data
        self._kept_bytes += len(data)
        while self._kept_bytes > self._limits.bag_cache_bytes and len(self._kept) > 1:
            _, old = self._kept.popitem(last=False)
            self._kept_bytes -= len(old)

    def _prepare(self, upcoming: Sequence[int]) -> None:
        left_bytes = _AHEAD_BYTES
        for number in upcoming[: self._threads_limit]:
            if number in self._ahead or number in self._kept:
                continue
            try:
                header = self._headers(number)
                left_bytes -= header.size
                if header.compression not in _SLOW or left_bytes < 0:
                    return
                where = check_chunk(self._source, header)
                data = self._source.read(header.data_position, header.data_size)
            except BagFormatError:
                return  # `get` reports the error when the chunk is requested
            if self._threads is None:
                self._threads = ThreadPoolExecutor(self._threads_limit, thread_name_prefix="chunks")
            self._ahead[number] = self._threads.submit(
                decompress, header.compression, data, header.size, where
            )
