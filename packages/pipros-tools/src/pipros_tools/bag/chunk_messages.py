"""Read the messages in the chunks of a bag in format 2.0 or older, in time order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from typing import Any

from pipros.basics.limits import Limits
from pipros_tools.bag.chunk_data import VIEW_BYTES, ChunkStore, are_large
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.contents import BagContents
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.records import U32, Op, checked_time, field_bytes, op_of, parse_head
from pipros_tools.bag.records import number as number_of
from pipros_tools.bag.runs import Entry, EntryRun, Span, runs_in_time_order, sorted_entries

_MESSAGE_HEADER_BYTES = 38
"""Size of the message record header that rosbag and rosbag_storage write."""

_READ_AHEAD = 8
"""Maximum number of chunks that may be read ahead of the current one."""


def fields_of_chunks(
    bag: BagContents,
    connections: Sequence[Connection],
    start_ns: int | None,
    end_ns: int | None,
    limits: Limits,
    *,
    as_views: bool,
    on_damage: Callable[[Iterable[str], BagFormatError], None],
    where: Callable[[Connection, int], bool] | None = None,
    has_places: bool = False,
) -> Iterator[tuple[Connection, int, Any, int, int]]:
    """Yield what `BagReader.stored_fields` describes, of the messages that `where` selects, if it is given.

    `where` is called when a message is next. A chunk is read for its first selected message.
    `on_damage` is called with the topics of each chunk that cannot be read, which is then left out, and with
    the error, which it may raise. With `has_places`, the last two fields are the position of the chunk in the
    file and the message's offset in the chunk.
    """
    ranks = {connection.id: rank for rank, connection in enumerate(connections)}
    spans = _spans(bag, ranks, start_ns, end_ns)
    headed = [(connection, *usual_headers(connection.id)) for connection in connections]
    chunks = _ChunksInOrder(bag, spans, limits)
    left_in_chunks: dict[int, int] = {}  # number of message bytes still allowed in each chunk
    unpack = U32.unpack_from

    def loaded(number: int) -> list[Entry]:
        try:
            return _sorted_entries(bag, ranks, start_ns, end_ns, number)
        except BagFormatError as error:
            counts = bag.layout.chunks[number].counts
            advised = BagFormatError(f"{error}. Try rosbag reindex")
            on_damage((each.topic for each in connections if each.id in counts), advised)
            return []

    def forget(number: int) -> None:
        chunks.store.drop(number)
        left_in_chunks.pop(number, None)

    try:
        for run in runs_in_time_order(spans, loaded):
            number = run.number
            entries = _selected_entries(run, connections, where)
            if entries is None:
                if run.is_last:
                    forget(number)
                continue
            size = bag.chunk_header(number).size
            is_view = as_views and are_large(size, len(run.entries))
            try:
                data = chunks.get(number, is_reusable=is_view)
            except BagFormatError as error:
                on_damage((connections[rank].topic for _, rank, _ in run.entries), error)
                continue
            of_large: Any = memoryview(data) if as_views and data is not None else data
            of_small: Any = of_large if is_view else data
            place = bag.layout.chunks[number].position if has_places else 0
            data_bytes = 0 if data is None else len(data)
            left_bytes = left_in_chunks.get(number, size)
            for time_ns, rank, offset in entries:
                connection, usual, as_in_cpp = headed[rank]
                if data is not None and (
                    data.startswith(usual, offset) or data.startswith(as_in_cpp, offset)
                ):
                    begin = offset + _MESSAGE_HEADER_BYTES + 8
                    after = begin + unpack(data, begin - 4)[0] if begin <= data_bytes else data_bytes + 1
                    if after > data_bytes:
                        raise _misplaced(bag, number, offset, "the message is truncated")
                    body = (of_large if after - begin > VIEW_BYTES else of_small)[begin:after]
                    left_bytes += begin - after
                else:
                    body = _message_at(bag, number, data, offset, connection)
                    left_bytes -= len(body)
                if left_bytes < 0:
                    raise _misplaced(bag, number, offset, "the messages are larger than their chunk")
                yield connection, time_ns, body, place, offset if has_places else 0
            left_in_chunks[number] = left_bytes
            if run.is_last:
                forget(number)
    finally:
        chunks.store.close()


class _ChunksInOrder:
    """A store of chunks that are read in the order of their first messages."""

    def __init__(self, bag: BagContents, spans: Sequence[Span], limits: Limits) -> None:
        self.store = ChunkStore(bag.source, bag.chunk_header, limits)
        self._order = [each.number for each in sorted(spans, key=lambda each: (each.start_ns, each.number))]
        self._place_of = {number: place for place, number in enumerate(self._order)}

    def get(self, number: int, *, is_reusable: bool) -> bytes | bytearray | None:
        """Return what `ChunkStore.get` returns, which may read the next chunks ahead."""
        after = self._place_of[number] + 1
        return self.store.get(number, self._order[after : after + _READ_AHEAD], is_reusable=is_reusable)


def _selected_entries(
    run: EntryRun, connections: Sequence[Connection], where: Callable[[Connection, int], bool] | None
) -> Iterable[Entry] | None:
    """Return the entries of a run that `where` selects, or None if it selects none of them.

    `where` is called for entries up to the first selected one at once, and for the others during iteration.
    """
    entries: Iterable[Entry] = run.entries
    if run.begin or run.end < len(run.entries):
        entries = islice(run.entries, run.begin, run.end)
    if where is None:
        return entries
    selected = (each for each in entries if where(connections[each[1]], each[0]))
    first = next(selected, None)
    return None if first is None else chain((first,), selected)


def _spans(
    bag: BagContents, ranks: Mapping[int, int], start_ns: int | None, end_ns: int | None
) -> list[Span]:
    """Return the chunks that may contain messages of the connections in `ranks` within the period."""
    return [
        Span(number, chunk.start_ns)
        for number, chunk in enumerate(bag.layout.chunks)
        if not ranks.keys().isdisjoint(chunk.counts.keys())
        and (start_ns is None or chunk.end_ns >= start_ns)
        and (end_ns is None or chunk.start_ns <= end_ns)
    ]


def _sorted_entries(
    bag: BagContents, ranks: Mapping[int, int], start_ns: int | None, end_ns: int | None, number: int
) -> list[Entry]:
    """Return a chunk's sorted index entries for the connections in `ranks` within the period."""
    index = bag.chunk_index(number)
    packed = [(ranks[key], data) for key, data in index.items() if key in ranks]
    entries = sorted_entries(packed, start_ns, end_ns)
    if entries:
        checked_time(entries[-1][0], _place(bag, number, entries[-1][2]))
    return entries


def _message_at(
    bag: BagContents, number: int, data: bytes | bytearray | None, offset: int, connection: Connection
) -> bytes:
    """Return a message that has an unusual header, or that is read individually from the file."""
    header = bag.chunk_header(number)

    def read(position: int, size: int) -> bytes:
        if position + size > header.size:
            raise _misplaced(bag, number, offset, "the message does not fit into its chunk")
        if data is not None:
            return bytes(data[position : position + size])
        return bag.source.read(header.data_position + position, size)

    where = _place(bag, number, offset)
    fields, data_position, data_size = parse_head(read, offset, where)
    is_own = "conn" not in fields or number_of(fields, "conn", 4, where) == connection.id
    if op_of(fields, where) != Op.MESSAGE or not is_own:
        raise _misplaced(bag, number, offset, f"there is no message of {connection.topic}")
    return read(data_position, data_size)


def _place(bag: BagContents, number: int, offset: int) -> str:
    return f"{bag.source.name}, chunk at byte {bag.layout.chunks[number].position}, offset {offset}"


def _misplaced(bag: BagContents, number: int, offset: int, what: str) -> BagFormatError:
    return BagFormatError(
        f"{_place(bag, number, offset)}: {what}; the index or the chunk is damaged. Try rosbag reindex"
    )


def usual_headers(connection: int) -> tuple[bytes, bytes]:
    """Return the bytes that precede the timestamp in rosbag's and in rosbag_storage's message records."""
    op, conn = ("op", bytes([Op.MESSAGE])), ("conn", U32.pack(connection))
    start, time = U32.pack(_MESSAGE_HEADER_BYTES), U32.pack(13) + b"time="
    return start + field_bytes([op, conn]) + time, start + field_bytes([conn, op]) + time
