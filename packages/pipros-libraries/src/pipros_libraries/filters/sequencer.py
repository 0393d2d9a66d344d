"""A sequencer that delays messages to order them by timestamp."""

from __future__ import annotations

from bisect import insort
from typing import Any

from pipros.basics.intervals import ClockWatch


class Sequencer:
    """Queue that delays messages in order to return them sorted by timestamp.

    Timestamps, the delay and the time are in nanoseconds. A message is dropped if a message with a later
    timestamp was already returned. If there are more than `queue_size` messages (0 for no limit), the message
    with the earliest timestamp is dropped. If the time moves back, the waiting messages are dropped.
    """

    def __init__(self, delay: int, queue_size: int) -> None:
        self.delay = delay
        self.queue_size = queue_size
        self._waiting: list[tuple[int, int, Any]] = []
        self._arrived = 0
        self._last_returned: int | None = None
        self._watch = ClockWatch()

    def add(self, stamp: int, message: Any) -> None:
        """Add a message, or drop it if it is too late."""
        if self._last_returned is not None and stamp < self._last_returned:
            return
        self._arrived += 1
        insort(self._waiting, (stamp, self._arrived, message))
        if self.queue_size and len(self._waiting) > self.queue_size:
            del self._waiting[0]

    def due(self, now: int) -> list[Any]:
        """Remove and return the messages whose delay has expired at the time `now`, ordered by timestamp."""
        if self._watch.has_gone_back(now):
            self._waiting, self._last_returned = [], None
        count = 0
        while count < len(self._waiting) and self._waiting[count][0] + self.delay <= now:
            count += 1
        due = self._waiting[:count]
        del self._waiting[:count]
        if due:
            self._last_returned = due[-1][0]
        return [message for _, _, message in due]
