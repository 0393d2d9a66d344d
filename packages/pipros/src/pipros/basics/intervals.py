"""Measure intervals on a clock that may move back, as simulated time does when a bag restarts.

A plain subtraction is negative after such a jump, and what depends on it waits until the old time is reached
again. For a deadline, write `min(deadline, now + duration)`, which never is further away than its duration.
"""

from __future__ import annotations

import math


def elapsed(now: float, since: float) -> float:
    """Return the time that has passed since a moment, or infinity if the clock has moved back before it.

    After a jump back, periodic work therefore is due, and what must be recent is outdated.

    >>> elapsed(5, 3), elapsed(1, 3)
    (2, inf)
    """
    return now - since if now >= since else math.inf


class ClockWatch:
    """Notices jumps back of a clock, if it is asked often."""

    def __init__(self) -> None:
        self._last = -math.inf

    def has_gone_back(self, now: float) -> bool:
        """Return whether `now` is earlier than at the last call."""
        last, self._last = self._last, now
        return now < last
