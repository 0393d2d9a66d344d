"""Measure the frequency of events over the last few reports."""

from __future__ import annotations

from collections import deque
from math import inf


class EventWindow:
    """Frequency of events over the last `reports` reporting intervals.

    The caller increments `count` for each event.
    """

    def __init__(self, reports: int, now: float) -> None:
        self.count = 0
        self._starts = deque([(now, 0)] * reports, maxlen=reports)

    def report(self, now: float) -> tuple[int, float, float]:
        """Return the number of events in the window, its length in seconds, and the events per second."""
        start, count = self._starts[0]
        self._starts.append((now, self.count))
        events, seconds = self.count - count, now - start
        if seconds > 0.0:
            return events, seconds, events / seconds
        return events, seconds, inf if events else 0.0


def judged(events: int, hz: float, low: float, high: float | None) -> tuple[int, str]:
    """Return the level and message for a frequency and its bounds, all in Hz."""
    if events == 0:
        return 2, "No events recorded."
    if hz < low:
        return 1, "Frequency too low."
    if high is not None and hz > high:
        return 1, "Frequency too high."
    return 0, "Desired frequency met"
