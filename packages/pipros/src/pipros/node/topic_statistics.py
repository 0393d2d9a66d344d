"""Topic statistics: a subscriber's measurements of each publisher, published on `/statistics`.

Source: http://wiki.ros.org/Topics#Topic_statistics. Disabled unless the parameter `/enable_statistics` is
true. This module performs no I/O: it receives arrival times and returns statistics.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from pipros.msg.time import NS_PER_S


@dataclass(frozen=True, slots=True)
class WindowLimits:
    """Limits on the number of messages in a window and on its length in seconds.

    Set by the parameters `/statistics_window_min_elements`, `..._max_elements`, `..._min_size` and
    `..._max_size`. The defaults are the same as in genuine nodes.
    """

    min_elements: int = 10
    max_elements: int = 100
    min_size_s: float = 4.0
    max_size_s: float = 64.0


@dataclass(frozen=True, slots=True)
class StatisticsWindow:
    """The statistics of one window. Times are in nanoseconds, durations in seconds."""

    start_ns: int
    stop_ns: int
    delivered: int
    dropped: int
    bytes: int
    period_mean_s: float
    period_stddev_s: float
    period_max_s: float
    age_mean_s: float
    age_stddev_s: float
    age_max_s: float


@dataclass(slots=True)
class TrafficMeter:
    """Measures one publisher's messages on one topic."""

    limits: WindowLimits = field(default_factory=WindowLimits)
    window_s: float = 1.0
    _start_ns: int = 0
    _arrivals_ns: list[int] = field(default_factory=list)
    _ages_ns: list[int] = field(default_factory=list)
    _bytes: int = 0
    _dropped: int = 0
    _last_sequence: int | None = None

    def add(
        self, now_ns: int, size: int, sequence: int | None, stamp_ns: int | None
    ) -> StatisticsWindow | None:
        """Count a received message. If it ends the window, return the window's statistics; otherwise None.

        `sequence` and `stamp_ns` come from the message's header; they are None if the message has no header.
        """
        if not 0 < self._start_ns <= now_ns:  # the first message, or the clock has moved back
            self._begin(now_ns)
        self._arrivals_ns.append(now_ns)
        self._bytes += size
        if stamp_ns:
            self._ages_ns.append(now_ns - stamp_ns)
        if sequence is not None:
            if self._last_sequence is not None and sequence > self._last_sequence + 1:
                self._dropped += sequence - self._last_sequence - 1
            self._last_sequence = sequence
        if now_ns - self._start_ns < self.window_s * NS_PER_S:
            return None
        window = self._figures(now_ns)
        self._adapt()
        self._begin(now_ns)
        return window

    def _begin(self, now_ns: int) -> None:
        self._start_ns = now_ns
        self._arrivals_ns.clear()
        self._ages_ns.clear()
        self._bytes = self._dropped = 0

    def _figures(self, now_ns: int) -> StatisticsWindow:
        arrivals = self._arrivals_ns
        periods = [later - earlier for earlier, later in itertools.pairwise(arrivals)]
        return StatisticsWindow(
            self._start_ns,
            now_ns,
            len(arrivals),
            self._dropped,
            self._bytes,
            *_spread(periods),
            *_spread(self._ages_ns),
        )

    def _adapt(self) -> None:
        """Adjust the length of the next window, so that it contains a reasonable number of messages."""
        limits = self.limits
        if len(self._arrivals_ns) > limits.max_elements and self.window_s / 2 >= limits.min_size_s:
            self.window_s /= 2
        elif len(self._arrivals_ns) < limits.min_elements and self.window_s * 2 <= limits.max_size_s:
            self.window_s *= 2


def _spread(spans_ns: list[int]) -> tuple[float, float, float]:
    """Return the mean, standard deviation and maximum in seconds, or zeros for an empty list."""
    if not spans_ns:
        return 0.0, 0.0, 0.0
    mean = sum(spans_ns) / len(spans_ns)
    stddev = math.sqrt(sum((span - mean) ** 2 for span in spans_ns) / len(spans_ns))
    return mean / NS_PER_S, stddev / NS_PER_S, max(spans_ns) / NS_PER_S
