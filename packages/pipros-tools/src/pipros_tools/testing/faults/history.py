"""Numbered messages, and a checker for duplicated, reordered, corrupted and lost messages."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

_FILLER = "0123456789abcdef"


class TornMessage(ValueError):
    """A message does not match its checksum, or was not created by `numbered_text`."""


def numbered_text(source: str, number: int, size: int = 0) -> str:
    """Return a string with its origin and a checksum: `SOURCE NUMBER CHECKSUM FILLER`.

    Args:
        source: a name without spaces. A restarted publisher needs a new name.
        number: the position of the message among the source's messages: 1, 2, 3…
        size: the number of filler characters.
    """
    start = number % len(_FILLER)
    filler = (_FILLER[start:] + _FILLER * (size // len(_FILLER) + 1))[:size]
    return f"{source} {number} {_checksum(source, str(number), filler):08x} {filler}"


def read_numbered(text: str) -> tuple[str, int]:
    """Return the source and number of a string created by `numbered_text`.

    Raises:
        TornMessage: the text is corrupted, or does not have this format.
    """
    parts = text.split(" ", 3)
    if len(parts) == 4 and parts[1].isdecimal():
        source, number, checksum, filler = parts
        if f"{_checksum(source, number, filler):08x}" == checksum:
            return source, int(number)
    raise TornMessage(f"a message is corrupted, or was not created by numbered_text: {text[:80]!r}")


def _checksum(source: str, number: str, filler: str) -> int:
    return zlib.crc32(f"{source} {number} {filler}".encode())


@dataclass(frozen=True, slots=True)
class NumberGap:
    """Consecutive messages from a source that a sink did not receive."""

    sink: str
    source: str
    first: int
    count: int


@dataclass(slots=True)
class _Sequence:
    last: int = 0
    received: int = 0
    duplicates: int = 0
    reordered: int = 0
    gaps: list[NumberGap] = field(default_factory=list)
    seen: set[int] = field(default_factory=set)


class History:
    """Record of the messages that each sink received from each source. Thread-safe.

    Messages before the first one that a sink receives do not count as lost, because the sink may not have
    been connected yet.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sent: dict[str, int] = {}
        self._sequences: dict[tuple[str, str], _Sequence] = {}
        self._torn: list[str] = []

    def next_text(self, source: str, size: int = 0) -> str:
        """Return the text of the source's next message, with `size` filler characters."""
        with self._lock:
            number = self._sent[source] = self._sent.get(source, 0) + 1
        return numbered_text(source, number, size)

    def receive(self, text: str, sink: str = "sink") -> None:
        """Record a message that a sink received."""
        try:
            source, number = read_numbered(text)
        except TornMessage as error:
            with self._lock:
                self._torn.append(f"[{sink}] {error}")
            return
        with self._lock:
            sequence = self._sequences.setdefault((sink, source), _Sequence())
            sequence.received += 1
            if number in sequence.seen:
                sequence.duplicates += 1
            elif number < sequence.last:
                sequence.reordered += 1
            elif sequence.last and number > sequence.last + 1:
                sequence.gaps.append(NumberGap(sink, source, sequence.last + 1, number - sequence.last - 1))
            sequence.seen.add(number)
            sequence.last = max(sequence.last, number)

    @property
    def received(self) -> int:
        """Total number of intact messages that all sinks received."""
        with self._lock:
            return sum(sequence.received for sequence in self._sequences.values())

    def last(self, source: str, sink: str = "sink") -> int:
        """Return the highest number that a sink received from a source, or 0 if it received none."""
        with self._lock:
            sequence = self._sequences.get((sink, source))
            return sequence.last if sequence else 0

    def sent(self, source: str) -> int:
        """Return the number of times that `next_text` was called for a source."""
        with self._lock:
            return self._sent.get(source, 0)

    @property
    def torn(self) -> list[str]:
        """One line for each message for which `read_numbered` raised `TornMessage`."""
        with self._lock:
            return list(self._torn)

    @property
    def gaps(self) -> list[NumberGap]:
        """The gaps in the received sequences, grouped by sink and source."""
        with self._lock:
            return [gap for sequence in self._sequences.values() for gap in sequence.gaps]

    def problems(self, *, counted: int = 0, breaks: int = 0) -> list[str]:
        """Return one line for each violated guarantee, or an empty list if there are no violations.

        Args:
            counted: the number of reported drops, that is, the sum of `dropped` for all publishers,
                subscribers and recorders.
            breaks: the number of broken links and killed nodes. Each of these explains one gap.
        """
        found = self.torn
        with self._lock:
            for (sink, source), sequence in self._sequences.items():
                about = f"[{sink}] from [{source}]"
                if sequence.duplicates:
                    found.append(f"{about}: {sequence.duplicates} messages were duplicated")
                if sequence.reordered:
                    found.append(f"{about}: {sequence.reordered} messages were reordered")
        return [*found, *self._unreported(counted, breaks)]

    def _unreported(self, counted: int, breaks: int) -> Iterator[str]:
        gaps = sorted(self.gaps, key=lambda gap: gap.count, reverse=True)[breaks:]
        lost = sum(gap.count for gap in gaps)
        if lost > counted:
            largest = gaps[0]
            yield (
                f"{lost} messages were lost and {counted} counted; the largest gap is {largest.count} "
                f"from number {largest.first} of [{largest.source}] at [{largest.sink}]"
            )
