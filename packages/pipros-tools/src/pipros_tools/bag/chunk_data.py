"""Cache of chunk contents. A thread pool decompresses bz2 and zstd chunks in advance."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol

from pipros.bag.compression import BZ2, NONE, ZSTD, decompress
from pipros.bag.errors import BagFormatError
from pipros.bag.index import ChunkHeader
from pipros.bag.source import Source
from pipros.basics.limits import Limits, limit_text

LARGE_BYTES = 16 * 1024 * 1024
"""Size above which uncompressed chunks are not cached. Their messages are read from the file one by one."""

_ORDINARY_RATIO = 1000
"""Maximum expansion ratio of ordinary messages. Only large blank images and maps exceed it."""

_ENTRY_BYTES_PER_BYTE = 16
"""Maximum plausible ratio of index bytes to compressed bytes.

A message usually adds at least one byte to a compressed chunk, and adds at most 16 bytes to an index.
"""

_VIEW_BYTES = 64 * 1024
"""Mean message size above which a chunk's messages are decoded without a copy."""

_SLOW = {BZ2, ZSTD}
"""Compressions whose chunks are decompressed in threads.

For lz4, threads would not save time. Allocating a chunk's memory takes longer than decompressing the chunk,
and twice as long in a thread, whose heap returns the memory to the system: reading a 0.9 MB image took
1,550 us of processor time instead of 700.
"""

_AHEAD_BYTES = 64 * 1024 * 1024
"""Maximum total uncompressed size of the chunks that one call of `ChunkStore.get` starts to read ahead."""


class Headers(Protocol):
    """Callable that takes a chunk's number and returns the chunk's header."""

    def __call__(self, number: int, /) -> ChunkHeader: ...


def read_chunk_data(source: Source, header: ChunkHeader, limits: Limits) -> bytes:
    """Return the entire content of a chunk.

    Raises:
        BagFormatError: the chunk is truncated, damaged or larger than allowed.
    """
    where = check_chunk(source, header, limits)
    data = source.read(header.data_position, header.data_size)
    return decompress(header.compression, data, header.size, where)


@contextmanager
def _with_advice() -> Iterator[None]:
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
    return size > count * _VIEW_BYTES


def check_chunk(source: Source, header: ChunkHeader, limits: Limits) -> str:
    """Check the size of a chunk against the limits, and return its location for error messages.

    Raises:
        BagFormatError: the chunk is larger than allowed.
    """
    where = f"{source.at(header.data_position)}, a chunk"
    if header.size > limits.bag_chunk_bytes:
        raise BagFormatError(
            f"{where}: its size must be at most {limits.bag_chunk_bytes} bytes (bag_chunk_bytes), "
            f"got {header.size}"
        )
    if limits.bag_expanded_bytes < header.size > _ORDINARY_RATIO * header.data_size:
        raise BagFormatError(
            f"{where}: its {header.data_size} bytes expand to {header.size}, over {_ORDINARY_RATIO} times "
            f"as many; {limit_text('bag_expanded_bytes', limits.bag_expanded_bytes)}"
        )
    return where


def check_index_size(source: Source, entry_bytes: int, limits: Limits) -> None:
    """Raise `BagFormatError` if the index entries are implausibly large for the file size."""
    if entry_bytes > limits.bag_index_bytes + _ENTRY_BYTES_PER_BYTE * source.size:
        raise BagFormatError(
            f"{source.name}: the index of this {source.size}-byte file needs {entry_bytes} "
            f"bytes; {limit_text('bag_index_bytes', limits.bag_index_bytes)}"
        )


class ChunkStore:
    """Cache of chunk contents. A thread pool decompresses upcoming chunks if their format is slow.

    The size of the cache is at most `bag_cache_bytes`, plus the chunk in use and the chunks that are read
    ahead.
    """

    def __init__(self, source: Source, headers: Headers, limits: Limits) -> None:
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
            with _with_advice():
                data = self._ahead.pop(number).result()
        elif is_reusable and header.compression == NONE and header.data_size == header.size:
            check_chunk(self._source, header, self._limits)
            data = self._spare if len(self._spare) == header.size else bytearray(header.size)
            self._spare = bytearray()
            self._source.read_into(data, header.data_position)
        else:
            check_chunk(self._source, header, self._limits)
            with _with_advice():
                data = read_chunk_data(self._source, header, self._limits)
        self._keep(number, data)
        return data

    def drop(self, number: int) -> None:
        """Discard a chunk that is no longer needed."""
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
                where = check_chunk(self._source, header, self._limits)
                data = self._source.read(header.data_position, header.data_size)
            except BagFormatError:
                return  # `get` reports the error when the chunk is requested
            if self._threads is None:
                self._threads = ThreadPoolExecutor(self._threads_limit, thread_name_prefix="chunks")
            self._ahead[number] = self._threads.submit(
                decompress, header.compression, data, header.size, where
            )
