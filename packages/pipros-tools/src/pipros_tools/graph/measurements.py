"""Format rates, bandwidths and delays as `rostopic hz`, `bw` and `delay` do."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pipros_tools.graph.samples import DEFAULT_WINDOW, RateWindow, SampleFigures

if TYPE_CHECKING:
    from pipros.basics.printable import Say

NO_NEW_MESSAGES = "no new messages"

BANDWIDTH_WINDOW = 100
"""Default window for `bw`, in messages."""


class Rates:
    """The rates of several topics. Thread-safe."""

    def __init__(self, topics: Sequence[str], window: int = DEFAULT_WINDOW, *, say: Say) -> None:
        """Create empty windows. `say` is called with a message if time jumps back."""
        self._say = say
        self._topics = tuple(topics)
        self._rates = {topic: RateWindow(window) for topic in topics}
        self._lock = threading.Lock()

    def add(self, topic: str, moment_s: float) -> None:
        with self._lock:
            if not self._rates[topic].add(moment_s):
                self._say("time has reset, resetting counters")

    def has_new(self) -> bool:
        with self._lock:
            return any(rate.has_new for rate in self._rates.values())

    def report(self) -> str:
        """Return the lines to print once a second."""
        with self._lock:
            new = {topic: rate.figures() for topic, rate in self._rates.items() if rate.has_new}
        figures = {topic: found for topic, found in new.items() if found is not None}
        if not figures:
            return NO_NEW_MESSAGES
        if len(self._topics) == 1:
            return rate_text(figures[self._topics[0]])
        return rate_table(figures)


def rate_text(figures: SampleFigures) -> str:
    """Format the rate of a single topic."""
    return (
        f"average rate: {_rate(figures):.3f}\n"
        f"\tmin: {figures.minimum:.3f}s max: {figures.maximum:.3f}s"
        f" std dev: {figures.deviation:.5f}s window: {figures.count}"
    )


def rate_table(figures: Mapping[str, SampleFigures]) -> str:
    """Format the rates of several topics as a table, with four significant digits."""
    rows = []
    for topic, found in figures.items():
        numbers = (_rate(found), found.minimum, found.maximum, found.deviation)
        rows.append([topic, *(str(float(f"{number:.4g}")) for number in numbers), str(found.count)])
    return _table(["topic", "rate", "min_delta", "max_delta", "std_dev", "window"], rows)


def bandwidth_table(figures: Mapping[str, tuple[float, SampleFigures]]) -> str:
    """Format the bandwidths and message sizes of several topics as a table."""
    rows = []
    for topic, (bytes_per_s, sizes) in figures.items():
        of_sizes = map(as_bytes, (sizes.mean, sizes.minimum, sizes.maximum))
        rows.append([topic, f"{as_bytes(bytes_per_s)}/s", *of_sizes, str(sizes.count)])
    return _table(["topic", "average", "mean", "min", "max", "window"], rows)


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    heading = "   ".join(text.center(width) for text, width in zip(headings, widths, strict=True))
    lines = ["   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join([heading, "=" * len(heading), *lines, ""])


def _rate(figures: SampleFigures) -> float:
    return 1.0 / figures.mean if figures.mean > 0 else 0.0


def bandwidth_text(bytes_per_s: float, sizes: SampleFigures) -> str:
    return (
        f"average: {as_bytes(bytes_per_s)}/s\n"
        f"\tmean: {as_bytes(sizes.mean)} min: {as_bytes(sizes.minimum)} max: {as_bytes(sizes.maximum)}"
        f" window: {sizes.count}"
    )


def delay_text(figures: SampleFigures) -> str:
    return (
        f"average delay: {figures.mean:.3f}\n"
        f"\tmin: {figures.minimum:.3f}s max: {figures.maximum:.3f}s"
        f" std dev: {figures.deviation:.5f}s window: {figures.count}"
    )


def as_bytes(size: float) -> str:
    """Format a size in bytes as ROS prints it.

    >>> as_bytes(9), as_bytes(3004), as_bytes(120_004)
    ('9.00B', '3.00KB', '0.12MB')
    """
    if size < 1000:
        return f"{size:.2f}B"
    if size < 100_000:
        return f"{size / 1000:.2f}KB"
    return f"{size / 1_000_000:.2f}MB"
