"""Bounded queue of received messages, so that a slow disk does not block the receiving threads."""

from __future__ import annotations

import threading
from collections import deque

from pipros.basics import one_thread
from pipros_tools.bag.connection import StoredMessage


class RecordQueue:
    """Queue between the receiving threads and the writing thread.

    Args:
        limit_bytes: maximum size; 0 for no limit. If it is exceeded, the oldest messages are dropped.
        limit_ns: maximum age relative to the newest message; 0 for no limit. Older messages are dropped.

    Attributes:
        dropped: number of dropped messages.
    """

    def __init__(self, limit_bytes: int, limit_ns: int = 0) -> None:
        self._limit = limit_bytes
        self._limit_ns = limit_ns
        self._waiting: deque[StoredMessage] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._is_closed = False
        self.dropped = 0

    def put(self, message: StoredMessage) -> None:
        """Add a message. Never waits for the writer."""
        with self._changed:
            if self._is_closed:
                return
            self._waiting.append(message)
            self._bytes += len(message.data)
            while len(self._waiting) > 1 and self._is_over(message):
                self._bytes -= len(self._waiting.popleft().data)
                self.dropped += 1
            if len(self._waiting) == 1:
                self._changed.notify()

    def _is_over(self, newest: StoredMessage) -> bool:
        if self._limit and self._bytes > self._limit:
            return True
        return bool(self._limit_ns) and newest.time_ns - self._waiting[0].time_ns > self._limit_ns

    def get_all(self, timeout_s: float) -> list[StoredMessage]:
        """Wait for a message, and return all queued messages.

        Return an empty list on timeout, or if the queue is empty and closed.
        """
        if not one_thread.has_threads():
            one_thread.wait(lambda: bool(self._waiting) or self._is_closed, timeout_s)
            timeout_s = 0.0
        with self._changed:
            if not self._waiting and not self._is_closed:
                self._changed.wait(timeout_s)
            taken = list(self._waiting)
            self._waiting.clear()
            self._bytes = 0
        return taken

    def close(self) -> None:
        """Ignore new messages from now on. Queued messages can still be retrieved."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
