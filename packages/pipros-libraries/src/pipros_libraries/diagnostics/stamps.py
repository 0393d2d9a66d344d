"""Measure the age of message timestamps on arrival."""

from __future__ import annotations


class StampDelays:
    """The minimum and maximum delay from timestamp to arrival since the last report, in seconds.

    `early_count`, `late_count` and `zero_count` count the reports with timestamps that were too far in the
    future, too far in the past, or zero.
    """

    def __init__(self) -> None:
        self.early_count = self.late_count = self.zero_count = 0
        self.forget()

    def forget(self) -> None:
        """Reset the delays, but not the counts. Call this after each report."""
        self.least = self.greatest = 0.0
        self.has_zero = False
        self.has_any = False

    def add(self, stamp: float, now: float) -> None:
        """Add the delay of a timestamp that arrived at `now`.

        A timestamp of zero is unset: it has no delay, and `judged` reports it only if others have arrived.
        """
        if stamp == 0:
            self.has_zero = True
            return
        delay = now - stamp
        self.greatest = max(self.greatest, delay) if self.has_any else delay
        self.least = min(self.least, delay) if self.has_any else delay
        self.has_any = True

    def judged(self, least: float, greatest: float) -> tuple[int, str]:
        """Return the level and message for the given bounds on the delay, and count each problem."""
        if not self.has_any:
            return 1, "No data since last update."
        found = (0, "Timestamps are reasonable.")
        if self.least < least:
            found = (2, "Timestamps too far in future seen.")
            self.early_count += 1
        if self.greatest > greatest:
            found = (2, "Timestamps too far in past seen.")
            self.late_count += 1
        if self.has_zero:
            found = (2, "Zero timestamp seen.")
            self.zero_count += 1
        return found
