"""Summaries of bags: the text and YAML that Noetic's `rosbag info` prints, and HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from pipros.msg.time import Time
from pipros_tools.bag.reader import BagReader


@dataclass(frozen=True, slots=True)
class Compression:
    """Number and total sizes (in bytes) of the chunks that use the same compression."""

    name: str
    chunks: int
    uncompressed: int
    compressed: int


@dataclass(frozen=True, slots=True)
class BagTopic:
    """Summary of a topic.

    Attributes:
        type: message type of the topic's first connection.
        frequency: rate in Hz, from the median time between messages; None if unknown.
    """

    topic: str
    type: str
    messages: int
    connections: int
    frequency: float | None


@dataclass(frozen=True, slots=True)
class BagInfo:
    """Summary of a bag. `start` and `end` are in seconds, or None if there are no messages.

    `left_out` lists the topics and files that cannot be read, with the reasons; `beside` has the names and
    numbers of what the file has beside messages, such as attachments.
    """

    path: str | None
    version: str
    size: int
    is_indexed: bool = False
    start: float | None = None
    end: float | None = None
    messages: int = 0
    compressions: Sequence[Compression] = ()
    types: Sequence[tuple[str, str]] = ()
    topics: Sequence[BagTopic] = field(default=())
    left_out: Sequence[tuple[str, str]] = ()
    beside: Mapping[str, int] = field(default_factory=dict)

    @property
    def compression(self) -> Compression:
        """The most frequent compression format, with the number and total sizes of all chunks."""
        return Compression(
            self.compressions[0].name if self.compressions else "none",
            sum(each.chunks for each in self.compressions),
            sum(each.uncompressed for each in self.compressions),
            sum(each.compressed for each in self.compressions),
        )


def bag_info(bag: BagReader, path: str | None, *, with_frequencies: bool = False) -> BagInfo:
    """Summarize a bag. This reads the headers of all chunks.

    For frequencies, it also reads the indexes of the chunks, or the messages of an MCAP file.

    Raises:
        BagFormatError: a header or an index is damaged.
    """
    left_out = (*bag.skipped_files.items(), *bag.skipped.items())
    known = BagInfo(path, bag.format_name, bag.size, left_out=left_out, beside=bag.beside())
    if not bag.message_count and not bag.connections:
        return known
    has_messages = bag.message_count > 0
    return replace(
        known,
        is_indexed=True,
        start=_seconds(bag.range_ns[0]) if has_messages else None,
        end=_seconds(bag.range_ns[1]) if has_messages else None,
        messages=bag.message_count,
        compressions=compressions(bag),
        types=sorted({(connection.type, connection.md5sum) for connection in bag.connections}),
        topics=topics(bag, with_frequencies=with_frequencies),
    )


def compressions(bag: BagReader) -> list[Compression]:
    """Return the compression formats of the chunks, with chunk counts and sizes, most frequent first."""
    found: dict[str, list[int]] = {}
    for number in range(len(bag.chunks)):
        header = bag.chunk_header(number)
        sums = found.setdefault(header.compression, [0, 0, 0])
        for at, value in enumerate((1, header.size, header.data_size)):
            sums[at] += value
    return sorted(
        (Compression(name, *sums) for name, sums in found.items()),
        key=lambda each: (each.chunks, each.name),
        reverse=True,
    )


def topics(
    bag: BagReader, wanted: Iterable[str] | None = None, *, with_frequencies: bool = False
) -> list[BagTopic]:
    """Return summaries of the topics in `wanted`, or of all topics if `wanted` is None, sorted by name."""
    counts = bag.count_by_connection()
    times = bag.times_ns() if with_frequencies else {}
    chosen = None if wanted is None else set(wanted)
    found = []
    for name, connections in sorted(bag.connections_by_topic().items()):
        if chosen is not None and name not in chosen:
            continue
        messages = sum(counts[connection.id] for connection in connections)
        frequency = None
        if with_frequencies and messages > 1:
            stamps = sorted(stamp for each in connections for stamp in times.get(each.id, ()))
            frequency = _frequency([_seconds(stamp) for stamp in stamps])
        found.append(BagTopic(name, connections[0].type, messages, len(connections), frequency))
    return found


def _seconds(time_ns: int) -> float:
    """Convert a timestamp to seconds, rounded as in Noetic, so that sums and differences equal Noetic's."""
    return Time(0, time_ns).to_sec()


def _frequency(times: Sequence[float]) -> float | None:
    periods = sorted(later - earlier for earlier, later in pairwise(times))
    if not periods:
        return None
    middle = len(periods) // 2
    median = periods[middle] if len(periods) % 2 else (periods[middle - 1] + periods[middle]) / 2
    return 1.0 / median if median > 0 else None
