"""Sliding windows of measurements: intervals between messages, delays, sizes. Performs no I/O."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

DEFAULT_WINDOW = 50_000
"""Default number of samples in a window."""


@dataclass(frozen=True, slots=True)
class SampleFigures:
    """Statistics of a window of samples.

    Attributes:
        mean, minimum, maximum, deviation: in the same unit as the samples.
        count: the number of samples.
    """

    mean: float
    minimum: float
    maximum: float
    deviation: float
    count: int


class Samples:
    """The last `window` samples."""

    def __init__(self, window: int = DEFAULT_WINDOW) -> None:
        self._values: deque[float] = deque(maxlen=max(window, 0))

    def add(self, value: float) -> None:
        self._values.append(value)

    def clear(self) -> None:
        self._values.clear()

    def figures(self) -> SampleFigures | None:
        """Return the statistics, or None if there are no samples."""
        values = list(self._values)
        if not values:
            return None
        mean = sum(values) / len(values)
        deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / len(values))
        return SampleFigures(mean, min(values), max(values), deviation, len(values))


class RateWindow:
    """The rate of events, computed from the times at which they occurred."""

    def __init__(self, window: int = DEFAULT_WINDOW) -> None:
        """Create an empty window for `window` events, that is, for `window - 1` intervals."""
        self._intervals = Samples(window - 1)
        self._last: float | None = None
        self.has_new = False

    def add(self, moment_s: float) -> bool:
        """Add an event.

        If time moved backwards, as it can in simulations, clear the window and return False.
        """
        last, self._last = self._last, moment_s
        if last is None:
            return True
        if moment_s < last:
            self._intervals.clear()
            return False
        self._intervals.add(moment_s - last)
        self.has_new = True
        return True

    def figures(self) -> SampleFigures | None:
        """Return the statistics of the intervals, in seconds, and reset `has_new`.

        `count` is the number of events.
        """
        self.has_new = False
        found = self._intervals.figures()
        if found is None:
            return None
        return SampleFigures(found.mean, found.minimum, found.maximum, found.deviation, found.count + 1)


class BandwidthWindow:
    """The bandwidth in bytes per second, computed from the sizes and arrival times of messages."""

    def __init__(self, window: int = DEFAULT_WINDOW) -> None:
        self._sizes = Samples(window)
        self._moments: deque[float] = deque(maxlen=max(window, 0))
        self._total: deque[int] = deque(maxlen=max(window, 0))

    def add(self, moment_s: float, size: int) -> None:
        self._sizes.add(size)
        self._moments.append(moment_s)
        self._total.append(size)

    def figures(self, now_s: float) -> tuple[float, SampleFigures] | None:
        """Return the bandwidth until now and the sizes' statistics, or None for fewer than two messages."""
        found = self._sizes.figures()
        if found is None or found.count < 2 or now_s <= self._moments[0]:
            return None
        return sum(self._total) / (now_s - self._moments[0]), found
