"""The order in which the links of a topic deliver their messages."""

from __future__ import annotations

import threading


class DeliveryLock:
    """Lock that makes a topic's links take turns delivering messages.

    A link that has just delivered a message queues behind the links that are already waiting. One of the
    waiting links holds `_gate`. With a single lock, a link with a backlog would reacquire the lock before a
    waiting thread wakes up.

    Attributes:
        is_held: function that returns whether a link delivers a message.
        is_wanted: function that returns whether another link is waiting for the lock. For speed, this and
            `release` are attributes instead of methods, because they are called for every message.
        release: releases the lock.
    """

    __slots__ = ("_gate", "_lock", "is_held", "is_wanted", "release")

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._lock = threading.Lock()
        self.release = self._lock.release
        self.is_held = self._lock.locked
        self.is_wanted = self._gate.locked

    def acquire(self) -> bool:
        """Acquire the lock. Return True if another link held it or was waiting for it."""
        if not self._gate.locked() and self._lock.acquire(blocking=False):
            return False
        with self._gate:
            self._lock.acquire()
        return True

    def pass_on(self) -> None:
        """Release the lock, and reacquire it after the waiting links."""
        self.release()
        self.acquire()
