"""Read the messages of a topic in groups, usually without a Python loop over the messages in a chunk.

rosbag and rosbag_storage write message records with headers of equal size, so the positions of the messages
follow from the index. Other bags, MCAP files and ROS 2 bags are read message by message.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.basics.limits import process_limits
from pipros.msg.bulk.cursors import joined_parts, values_at
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.chunk_data import LARGE_BYTES, ChunkStore, check_chunk
from pipros_tools.bag.chunk_messages import usual_headers
from pipros_tools.bag.compression import NONE
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.contents import BagContents
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.records import TIMES_NS

import numpy as np  # isort: skip  # after `pipros.msg.bulk`, whose error names the extra

if TYPE_CHECKING:
    from numpy.typing import NDArray

_LENGTH = np.dtype("<u4")
_BUFFER_BYTES = 1 << 22
"""From this array size on, numpy requests huge pages from the system, which cause fewer page faults."""


class MessageGroup(NamedTuple):
    """Messages in order of receipt: their concatenated bytes, their sizes, and their times (ns)."""

    data: NDArray[np.uint8]
    sizes: NDArray[np.int64]
    times: NDArray[np.int64]

    @property
    def bytes(self) -> int:
        """The size of the messages in bytes, plus 16 bytes for the size and the time of each message."""
        return len(self.data) + 16 * len(self.sizes)

    def parts(self, limit: int) -> Iterator[MessageGroup]:
        """Yield the messages in groups of at most `limit` bytes. A larger message forms its own group."""
        weights = np.cumsum(self.sizes + 16)
        first = done = 0
        while first < len(weights):
            last = max(first + 1, int(np.searchsorted(weights, done + limit, "right")))
            rows = slice(first, last)
            data = self.data[done - 16 * first : int(weights[last - 1]) - 16 * last]
            yield MessageGroup(data, self.sizes[rows], self.times[rows])
            first, done = last, int(weights[last - 1])

    def take(self, rows: NDArray[np.int64]) -> MessageGroup:
        """Return the messages with the given indices."""
        begins = np.cumsum(self.sizes) - self.sizes
        sizes = self.sizes[rows]
        return MessageGroup(joined_parts(self.data, begins[rows], sizes), sizes, self.times[rows])


class _Unusual(Exception):
    """The messages must be read one by one, or are read faster that way."""


def groups_of(
    bag: BagContents | None,
    connections: Sequence[Connection],
    start_ns: int | None,
    end_ns: int | None,
    limit: int,
    fields: Callable[[], Iterator[tuple[Connection, int, Any, int, int]]],
) -> Iterator[MessageGroup]:
    """Yield what `BagReader.message_groups` describes.

    Args:
        bag: a bag with chunks as rosbag writes them; None if it has none.
        fields: returns the same messages, one by one.
    """
    done = 0
    if bag is not None and bag.layout.version.number == 200:
        try:
            for group in _of_chunks(bag, connections, start_ns, end_ns, limit):
                yield group
                done += len(group.sizes)
            return
        except _Unusual:
            pass
    yield from grouped(islice(fields(), done, None), limit)


def grouped(fields: Iterable[tuple[Connection, int, Any, int, int]], limit: int) -> Iterator[MessageGroup]:
    """Yield the messages from `BagReader.stored_fields` in groups of about `limit` bytes."""
    pieces: list[bytes] = []
    times: list[int] = []
    size = 0
    for _, time_ns, body, _, _ in fields:
        pieces.append(body if body.__class__ is bytes else bytes(body))
        times.append(time_ns)
        size += len(body)
        if size + 16 * len(pieces) > limit:
            yield _group(pieces, times)
            pieces, times, size = [], [], 0
    if pieces:
        yield _group(pieces, times)


def joined_groups(groups: Sequence[MessageGroup]) -> MessageGroup:
    """Join groups; the result is empty if there are none."""
    if len(groups) == 1:
        return groups[0]
    if not groups:
        return _group([], [])
    return MessageGroup(*(np.concatenate(each) for each in zip(*groups, strict=True)))


def _group(pieces: list[bytes], times: list[int]) -> MessageGroup:
    data = np.frombuffer(b"".join(pieces), np.uint8)
    return MessageGroup(data, np.fromiter(map(len, pieces), np.int64, len(pieces)), np.array(times, np.int64))


def _of_chunks(
    bag: BagContents, connections: Sequence[Connection], start_ns: int | None, end_ns: int | None, limit: int
) -> Iterator[MessageGroup]:
    wanted = {each.id for each in connections}
    chunks = [
        (chunk, number)
        for number, chunk in enumerate(bag.chunks)
        if not chunk.counts.keys().isdisjoint(wanted)
        and (start_ns is None or chunk.end_ns >= start_ns)
        and (end_ns is None or chunk.start_ns <= end_ns)
    ]
    chunks.sort(key=lambda each: (each[0].start_ns, each[1]))
    # Messages of several connections with equal times are ordered by connection, even across chunks.
    # Therefore, the time ranges of the chunks must not touch.
    apart = 1 if len(connections) > 1 else 0
    if any(later.start_ns < earlier.end_ns + apart for (earlier, _), (later, _) in pairwise(chunks)):
        raise _Unusual
    numbers = [number for _, number in chunks]
    chunk_reader = _ChunkReader(bag)
    count = sum(chunk.counts[each] for chunk, _ in chunks for each in wanted & chunk.counts.keys())
    collected = _CollectedMessages(limit, count)
    rank_of = {connection.id: rank for rank, connection in enumerate(connections)}
    try:
        for at, (chunk, number) in enumerate(chunks):
            data = chunk_reader.read(number, numbers[at + 1 : at + 9])
            times, begins, sizes = _messages(bag, number, rank_of, data)
            if len(times) and not chunk.start_ns <= times[0] <= times[-1] <= min(chunk.end_ns, TIMES_NS - 1):
                raise _Unusual
            first = 0 if start_ns is None else int(np.searchsorted(times, start_ns, "left"))
            last = len(times) if end_ns is None else int(np.searchsorted(times, end_ns, "right"))
            rows = slice(first, last)
            yield from collected.add(data, begins[rows], sizes[rows], times[rows])
    except (_Unusual, BagFormatError):  # reading the messages one by one reports the damage
        yield from collected.taken()
        raise _Unusual from None
    finally:
        chunk_reader.store.close()
    yield from collected.taken()


class _CollectedMessages:
    """The messages of several chunks, copied one after another into one array.

    Touching new memory takes longer than copying, so no other array is allocated.
    """

    def __init__(self, limit: int, count: int) -> None:
        """Start without messages. `count` is the number of messages that will be added."""
        self._limit = limit
        self._count = count
        self._buffer: NDArray[np.uint8] = np.empty(0, np.uint8)
        self._filled = 0
        self._parts: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []

    def add(self, data: NDArray[np.uint8], begins: Any, sizes: Any, times: Any) -> Iterator[MessageGroup]:
        """Add the messages of a chunk. If they do not fit, first yield the messages collected so far."""
        size = int(sizes.sum())
        if self._filled + size > len(self._buffer):
            yield from self.taken()
            expected = 1 + size * self._count // max(len(sizes), 1) * 9 // 8
            self._buffer = np.empty(max(size, min(self._limit, expected)), np.uint8)
        end = self._filled + size
        joined_parts(data, begins, sizes, out=self._buffer[self._filled : end])
        self._filled = end
        self._count -= len(sizes)
        self._parts.append((sizes, times))

    def taken(self) -> Iterator[MessageGroup]:
        """Yield the collected messages, if there are any, and start again without messages."""
        if self._parts:
            sizes, times = map(np.concatenate, zip(*self._parts, strict=True))
            yield MessageGroup(self._buffer[: self._filled], sizes, times)
        self._filled, self._parts = 0, []
        self._buffer = np.empty(0, np.uint8)


class _ChunkReader:
    """Reader of whole chunks.

    Uncompressed chunks share a buffer, because touching new memory is slower than reading.
    """

    def __init__(self, bag: BagContents) -> None:
        self._bag = bag
        self._limits = process_limits()
        self._buffer: NDArray[np.uint8] = np.empty(0, np.uint8)
        self.store = ChunkStore(bag.source, bag.chunk_header, self._limits)

    def read(self, number: int, upcoming: Sequence[int]) -> NDArray[np.uint8]:
        """Return the content of a chunk, which is valid until the next call."""
        header = self._bag.chunk_header(number)
        if header.compression == NONE and header.size == header.data_size <= LARGE_BYTES:
            check_chunk(self._bag.source, header)
            if len(self._buffer) < header.size:
                self._buffer = np.empty(max(header.size, _BUFFER_BYTES), np.uint8)
            content = self._buffer[: header.size]
            self._bag.source.read_into(content.data, header.data_position)
            return content
        data = self.store.get(number, upcoming)
        if data is None:
            raise _Unusual
        self.store.drop(number)
        return np.frombuffer(data, np.uint8)


def _messages(
    bag: BagContents, number: int, rank_of: Mapping[int, int], data: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the times, positions and sizes of the messages in a chunk, in the order of `BagReader`."""
    index = bag.chunk_index(number)
    found = []
    for identity in rank_of.keys() & index.keys():
        entries = np.frombuffer(index[identity], _LENGTH).reshape(-1, 3).astype(np.int64)
        times, offsets = entries[:, 0] * NS_PER_S + entries[:, 1], entries[:, 2]
        headers = [np.frombuffer(each, np.uint8) for each in usual_headers(identity)]
        size = len(headers[0])
        begins = offsets + size + 12  # the message follows its time and its size
        if (begins > len(data)).any():
            raise _Unusual
        records = values_at(data, offsets, None, np.dtype((np.void, size))).view(np.uint8).reshape(-1, size)
        if not np.logical_or(*((records == each).all(axis=1) for each in headers)).all():
            raise _Unusual
        sizes = values_at(data, begins - 4, None, _LENGTH).astype(np.int64)
        found.append((times, begins, sizes, np.full(len(times), rank_of[identity])))
    if not found:
        raise _Unusual
    times, begins, sizes, ranks = (
        found[0] if len(found) == 1 else map(np.concatenate, zip(*found, strict=True))
    )
    if (begins + sizes > len(data)).any() or int(sizes.sum()) > len(data):
        raise _Unusual  # reading the messages one by one reports the damage
    if len(found) == 1 and (times[1:] > times[:-1]).all():
        return times, begins, sizes
    order = np.lexsort((begins, ranks, times))
    return times[order], begins[order], sizes[order]
