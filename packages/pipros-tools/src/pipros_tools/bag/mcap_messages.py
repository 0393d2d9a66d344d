"""Read the messages in an MCAP file in time order, with few chunks in memory.

While the messages of a chunk are being yielded, their times and offsets are kept in memory. As with bags,
chunk contents are cached, and are decompressed again if necessary (`chunk_data.py`).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Any

from pipros.basics.limits import Limits
from pipros_tools.bag.chunk_data import (
    ChunkStore,
    are_large,
    read_chunk_data,
    record_numbers,
    with_advice,
)
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.mcap_records import (
    CHUNK,
    DATA_END,
    FOOTER,
    MAGIC,
    MESSAGE,
    MESSAGE_START,
    RECORD,
    Entries,
    McapChunk,
    check_content,
    message_entries,
    read_chunk,
    records,
)
from pipros_tools.bag.runs import Span, runs_in_time_order
from pipros_tools.bag.source import Source

McapMessage = tuple[int, int, Any, int, int]
"""Channel, timestamp (ns), serialized message, sequence number, and publish time (ns)."""

OnDamage = Callable[[Iterable[int], BagFormatError], None]
"""Function that is called with the channels of a chunk that cannot be read, and with the error."""

_INDEX_ENTRY_BYTES = 16
"""Size of a message's entry in the index of its chunk: a time and an offset."""

_LOOSE = -1
"""Number of a pseudo chunk that contains the selected messages outside of chunks."""


class McapMessages:
    """Single-use iterable of the messages on some channels between two timestamps (ns), inclusive.

    Args:
        indexes: the summary's chunk indexes, sorted by position.
        wanted: IDs of the channels.
        first, last: timestamps (ns).
        as_views: whether to yield large messages as views of their chunk; see `BagReader.stored_fields`.
        on_damage: called with the channels of each chunk that is left out because it cannot be read, and with
            the error, which it may raise.

    Raises:
        BagFormatError: the constructor or the iteration reaches a damaged part of the file.
    """

    def __init__(
        self,
        source: Source,
        indexes: Sequence[Any],
        limits: Limits,
        wanted: Collection[int],
        first: int,
        last: int,
        as_views: bool,
        on_damage: OnDamage,
    ) -> None:
        self._source = source
        self._wanted, self._first, self._last = wanted, first, last
        self._as_views, self._on_damage = as_views, on_damage
        self._chunks: dict[int, McapChunk] = {}
        self._entries: dict[int, Entries] = {}
        self._numbers = record_numbers(source)
        self._places = [each.chunk_start_offset for each in indexes]
        self._channels = [each.message_index_offsets.keys() or wanted for each in indexes]
        self._max_messages = [each.message_index_length // _INDEX_ENTRY_BYTES for each in indexes]
        times = [(each.message_start_time, each.message_end_time) for each in indexes]
        self._loose = Entries(array("Q"), array("Q"))
        if not indexes:
            times = self._find_chunks()
        spans = [
            Span(number, max(begin, first))
            for number, (begin, end) in enumerate(times)
            if begin <= last and end >= first
        ]
        self._spans = sorted(spans, key=lambda span: (span.start_ns, span.number))
        self._next_of = {span.number: at + 1 for at, span in enumerate(self._spans)}
        self._store = ChunkStore(source, self._header, limits)

    def __iter__(self) -> Iterator[McapMessage]:
        spans, source = list(self._spans), self._source
        if self._loose:
            spans.append(Span(_LOOSE, self._loose.times[0]))
        size_of, start_of = RECORD.unpack_from, MESSAGE_START.unpack_from
        head_bytes = RECORD.size + MESSAGE_START.size
        try:
            for run in runs_in_time_order(spans, self._load):
                number = run.number
                data, base = None, 0
                if number != _LOOSE:
                    base = self._header(number).data_position
                    data = self._store.get(number)
                entries = self._entries[number]
                content: Any = data
                if data is not None and (self._is_reusable(number) or self._is_view(len(data), len(entries))):
                    content = memoryview(data)
                for time, offset in zip(
                    entries.times[run.begin : run.end], entries.offsets[run.begin : run.end], strict=True
                ):
                    if data is not None:
                        channel, sequence, _, published = start_of(data, offset + RECORD.size)
                        end = offset + RECORD.size + size_of(data, offset)[1]
                        yield channel, time, content[offset + head_bytes : end], sequence, published
                    else:
                        head = source.read(base + offset, head_bytes)
                        size = size_of(head)[1] - MESSAGE_START.size
                        body = source.read(base + offset + head_bytes, size)
                        channel, sequence, _, published = start_of(head, RECORD.size)
                        yield channel, time, body, sequence, published
                if run.is_last:
                    del self._entries[number]
                    self._store.drop(number)
        finally:
            self._store.close()

    def _header(self, number: int) -> ChunkHeader:
        return self._chunk(number).header

    def _chunk(self, number: int) -> McapChunk:
        chunk = self._chunks.get(number)
        if chunk is None:
            place = self._places[number]
            chunk = read_chunk(self._source, place)
            following = number + 1
            limit = self._places[following] if following < len(self._places) else self._source.size
            if chunk.header.data_position + chunk.header.data_size > limit:
                raise BagFormatError(
                    f"{self._source.at(place)}: the chunk must end before the next one, at byte {limit}"
                )
            self._chunks[number] = chunk
        return chunk

    def _load(self, number: int) -> Entries:
        try:
            return self._loaded(number)
        except BagFormatError as error:
            channels = self._channels[number] if number < len(self._channels) else self._wanted
            self._on_damage((each for each in channels if each in self._wanted), error)
            return Entries(array("Q"), array("Q"))

    def _loaded(self, number: int) -> Entries:
        if number == _LOOSE:
            found = self._loose
        else:
            chunk, at = self._chunk(number), self._next_of[number]
            upcoming = [span.number for span in self._spans[at : at + 8]]
            data = self._store.get(number, upcoming, is_reusable=self._is_reusable(number))
            if data is None:
                data = read_chunk_data(self._source, chunk.header)
            where, limits = self._source.at(self._places[number]), (self._first, self._last)
            with with_advice():
                check_content(self._source, chunk, data)
                found = message_entries(data, where, self._wanted, *limits, self._numbers)
        if found:
            self._entries[number] = found
        return found

    def _is_reusable(self, number: int) -> bool:
        """Return whether all messages in a chunk will be views of its content.

        If so, another chunk may overwrite the content later. The number of messages is taken from the chunk's
        index. Return False if the chunk has no index.
        """
        count = self._max_messages[number] if number < len(self._max_messages) else 0
        return count > 0 and self._is_view(self._header(number).size, count)

    def _is_view(self, size: int, count: int) -> bool:
        return self._as_views and are_large(size, count)

    def _find_chunks(self) -> list[tuple[int, int]]:
        """Scan a file whose summary does not list chunks. Return the first and last time of each chunk."""
        times: list[tuple[int, int]] = []
        stamps, positions = array("Q"), array("Q")
        for op, position, size in records(self._source, len(MAGIC)):
            if op == CHUNK:
                chunk = read_chunk(self._source, position - RECORD.size)
                self._places.append(position - RECORD.size)
                times.append((chunk.start, chunk.end))
            elif op == MESSAGE:
                if size < MESSAGE_START.size:
                    raise BagFormatError(f"{self._source.at(position)}: a message must have a header")
                start = self._source.read(position, MESSAGE_START.size)
                channel, _, time, _ = MESSAGE_START.unpack(start)
                if channel in self._wanted and self._first <= time <= self._last:
                    stamps.append(time)
                    positions.append(position - RECORD.size)
            elif op in (DATA_END, FOOTER):
                break
        self._loose = Entries(stamps, positions)
        return times
