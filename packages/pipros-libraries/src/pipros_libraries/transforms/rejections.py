"""Report rejected transforms without flooding the terminal."""

from __future__ import annotations

import time
from collections.abc import Callable

PERIOD_S = 10.0
_MOST_FRAMES = 1000


class Rejections:
    """Reports each kind of rejection at once, then at most once in `PERIOD_S` for each frame.

    A publisher that repeats a transform with the same stamp, as many drivers do, would otherwise print a line
    for each message (geometry2#467).
    """

    def __init__(
        self, report: Callable[[str], object], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._report = report
        self._clock_s = clock_s
        self._quiet: dict[tuple[str, str], tuple[float, int]] = {}  # end, and number of unreported rejections

    def add(self, frame: str, reason: str) -> None:
        """Report the reason for which a transform of a frame was rejected. It begins with its kind."""
        key = reason.partition(" ")[0], frame
        now_s = self._clock_s()
        until_s, count = self._quiet.get(key, (now_s, 0))
        if now_s < until_s:
            self._quiet[key] = until_s, count + 1
            return
        if len(self._quiet) >= _MOST_FRAMES:
            self._quiet.clear()
        self._quiet[key] = now_s + PERIOD_S, 0
        self._report(f"{reason} (and {count} more since the last warning)" if count else reason)
