"""Order the messages in many chunks by time, with as few open chunks as possible. Performs no I/O.

If the time range of a chunk does not overlap the range of any other chunk, its messages are yielded as one
run. The sorted entries of overlapping chunks are merged; a chunk is held in memory only from its first
message to its last.

Messages with equal timestamps are ordered by connection, then by position in the file.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush, heapreplace

from pipros_tools.bag.records import parse_entries

Entry = tuple[int, int, int]
"""An entry: timestamp (ns), rank of the connection, and offset in the chunk."""


@dataclass(frozen=True, slots=True)
class Span:
    """The number of a chunk to read, and the timestamp (ns) of its earliest message."""

    number: int
    start_ns: int


@dataclass(frozen=True, slots=True)
class EntryRun:
    """A run of messages in one chunk, `entries[begin:end]`, with no messages from other chunks between them.

    Attributes:
        is_last: whether this is the last run of the chunk.
    """

    number: int
    entries: Sequence[Entry]
    begin: int
    end: int
    is_last: bool


def sorted_entries(
    packed: Sequence[tuple[int, bytes]], start_ns: int | None, end_ns: int | None
) -> list[Entry]:
    """Return the entries of one chunk in time order.

    Args:
        packed: for each connection, its rank and its entries in the file's format.
        start_ns, end_ns: earliest and latest timestamp, inclusive.
    """
    entries: list[Entry] = []
    for rank, data in packed:
        entries += parse_entries(data, rank)
    entries.sort()
    begin = bisect_left(entries, (start_ns,)) if start_ns is not None else 0
    stop = bisect_left(entries, (end_ns + 1,)) if end_ns is not None else len(entries)
    return entries[begin:stop] if begin or stop < len(entries) else entries


def runs_in_time_order(spans: Sequence[Span], load: Callable[[int], Sequence[Entry]]) -> Iterator[EntryRun]:
    """Yield all messages in the chunks in time order, as runs.

    Args:
        load: function that returns a chunk's sorted entries. It is called once per chunk, when the first
            message of the chunk is due.
    """
    waiting = sorted(spans, key=lambda span: (span.start_ns, span.number), reverse=True)
    # (timestamp, rank, number) for each active chunk's next message, and the message's index in the entries
    active: list[tuple[tuple[int, int, int], int]] = []
    entries_of: dict[int, Sequence[Entry]] = {}
    while waiting or active:
        while waiting and (not active or waiting[-1].start_ns <= active[0][0][0]):
            span = waiting.pop()
            entries = load(span.number)
            if entries:
                entries_of[span.number] = entries
                heappush(active, ((*entries[0][:2], span.number), 0))
        if not active:
            continue
        head, begin = active[0]
        number = head[2]
        entries = entries_of[number]
        end = len(entries)
        if len(active) > 1:
            other = min(active[1:3])[0]
            bound = (other[0], other[1] + (number < other[2]))
            end = bisect_left(entries, bound, begin)
        if waiting:
            end = min(end, bisect_left(entries, (waiting[-1].start_ns,), begin))
        end = max(end, begin + 1)
        is_last = end == len(entries)
        if is_last:
            heappop(active)
            del entries_of[number]
        else:
            heapreplace(active, ((*entries[end][:2], number), end))
        yield EntryRun(number, entries, begin, end, is_last)
