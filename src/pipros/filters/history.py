"""The newest messages of a topic, and messages held back until they can be passed on in order."""

from __future__ import annotations

from bisect import insort
from typing import Any


class History:
    """The newest `size` messages with their stamps, in the order of their arrival."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.messages: list[Any] = []
        self.stamps: list[Any] = []

    def add(self, stamp: Any, message: Any) -> None:
        """Adds a message; of more than `size`, the one that arrived first is dropped."""
        self.stamps.append(stamp)
        self.messages.append(message)
        if len(self.messages) > self.size:
            del self.messages[0]
            del self.stamps[0]

    def between(self, first: Any, last: Any) -> list[Any]:
        """The messages from one stamp to another, both included."""
        return [
            message
            for message, stamp in zip(self.messages, self.stamps, strict=True)
            if first <= stamp <= last
        ]

    def first_from(self, stamp: Any) -> Any:
        """The message that arrived first of those with this stamp or a later one; None without any."""
        for message, known in zip(self.messages, self.stamps, strict=True):
            if known >= stamp:
                return message
        return None

    def last_until(self, stamp: Any) -> Any:
        """The message that arrived last of those with this stamp or an earlier one; None without any."""
        for message, known in zip(reversed(self.messages), reversed(self.stamps), strict=True):
            if known <= stamp:
                return message
        return None


class Sequencer:
    """Messages in the order of their stamps, each held back for a while, so that earlier ones may still come.

    Stamps, the delay and the time are nanoseconds. A message that is older than one passed on already is
    dropped; so is the oldest of more than `queue_size`.
    """

    def __init__(self, delay: int, queue_size: int) -> None:
        self.delay = delay
        self.queue_size = queue_size
        self._waiting: list[tuple[int, int, Any]] = []
        self._arrived = 0
        self._passed_on: int | None = None

    def add(self, stamp: int, message: Any) -> None:
        """Adds a message."""
        if self._passed_on is not None and stamp < self._passed_on:
            return
        self._arrived += 1
        insort(self._waiting, (stamp, self._arrived, message))
        if self.queue_size and len(self._waiting) > self.queue_size:
            del self._waiting[0]

    def due(self, now: int) -> list[Any]:
        """The messages to pass on now, in order."""
        count = 0
        while count < len(self._waiting) and self._waiting[count][0] + self.delay <= now:
            count += 1
        due = self._waiting[:count]
        del self._waiting[:count]
        if due:
            self._passed_on = due[-1][0]
        return [message for _, _, message in due]
