"""Compute the tracks of a timeline: the distribution of each topic's messages, from the bag's index alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Final

from pipros_page.bags.rewind import Recording
from pipros_tools.bag.mcap_files import McapReader
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import parse_entries

BINS: Final = 240
EXACT_CHUNKS: Final = 40
"""Maximum number of chunks in a bag whose chunk indexes are read. The indexes contain all message times."""

_Span = tuple[int, int, Mapping[int, int]]
"""First and last time (ns) of some messages, and the number of messages by connection id."""


@dataclass(frozen=True, slots=True)
class Track:
    """The distribution of a topic's messages over time.

    Attributes:
        bins: estimated number of messages in each of `BINS` equal parts of the bag's duration. In an MCAP
            file, each chunk counts as one message of each topic in it.
    """

    topic: str
    type: str
    count: int
    bins: list[float]


def tracks(reader: BagReader) -> list[Track]:
    """Return the tracks of all topics, sorted by name. Raise `NoMessages` if the bag is empty."""
    begin_ns, end_ns = reader.range_ns
    width_ns = max(end_ns - begin_ns, 1) / BINS
    bins: dict[int, list[float]] = {each.id: [0.0] * BINS for each in reader.connections}

    def bin_of(time_ns: int) -> int:
        return min(max(int((time_ns - begin_ns) / width_ns), 0), BINS - 1)

    for first_ns, last_ns, counts in _spans(reader):
        first, last = bin_of(first_ns), bin_of(last_ns)
        for connection, count in counts.items():
            row = bins.get(connection, [])
            for at in range(first, min(last, len(row) - 1) + 1):
                row[at] += count / (last - first + 1)
    totals = reader.count_by_connection()
    found: dict[str, Track] = {}
    for each in reader.connections:
        known = found.get(each.topic, Track(each.topic, each.type, 0, [0.0] * BINS))
        total = [round(a + b, 4) for a, b in zip(known.bins, bins[each.id], strict=True)]
        found[each.topic] = Track(each.topic, each.type, known.count + totals.get(each.id, 0), total)
    return [found[topic] for topic in sorted(found)]


def _spans(reader: BagReader) -> Iterator[_Span]:
    if isinstance(reader, Recording):
        for message in reader.stored_messages():
            yield message.time_ns, message.time_ns, {message.connection.id: 1}
    elif isinstance(reader, McapReader):
        for chunk in reader.chunks:
            yield (
                chunk.message_start_time,
                chunk.message_end_time,
                dict.fromkeys(chunk.message_index_offsets, 1),
            )
    elif len(reader.chunks) > EXACT_CHUNKS:
        for chunk in reader.chunks:
            yield chunk.start_ns, chunk.end_ns, chunk.counts
    else:
        indexes = (reader.chunk_index(number) for number in range(len(reader.chunks)))
        for connection, data in chain.from_iterable(index.items() for index in indexes):
            for time_ns, _, _ in parse_entries(data):
                yield time_ns, time_ns, {connection: 1}
