"""The messages that a recording has yet to write: bounded, so that a slow disk does not block publishers."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from pipros.msg.time import NS_PER_S


@dataclass(frozen=True, slots=True)
class Received:
    """A message as it came: its topic, its publisher's connection header, its bytes and when it came."""

    topic: str
    header: Mapping[str, str]
    data: bytes
    seconds: int
    nanoseconds: int


class RecordQueue:
    """A queue between the threads of links and the one that writes.

    Args:
        limit_bytes: above it the oldest messages are dropped and counted; 0 for no limit.
        limit_ns: messages that are older than the newest one by more than this are dropped, too; 0 for no
            limit.

    Attributes:
        dropped: how many messages were dropped.
    """

    def __init__(self, limit_bytes: int, limit_ns: int = 0) -> None:
        self._limit = limit_bytes
        self._limit_ns = limit_ns
        self._waiting: deque[Received] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._is_closed = False
        self.dropped = 0

    def put(self, message: Received) -> None:
        """Adds a message. Blocks only while another thread uses the queue."""
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

    def _is_over(self, newest: Received) -> bool:
        if self._limit and self._bytes > self._limit:
            return True
        oldest = self._waiting[0]
        age = (newest.seconds - oldest.seconds) * NS_PER_S + newest.nanoseconds - oldest.nanoseconds
        return bool(self._limit_ns) and age > self._limit_ns

    def get_all(self, timeout_s: float) -> list[Received]:
        """All messages that wait. Waits for one; an empty list after `timeout_s`, or when it is closed."""
        with self._changed:
            if not self._waiting and not self._is_closed:
                self._changed.wait(timeout_s)
            taken = list(self._waiting)
            self._waiting.clear()
            self._bytes = 0
        return taken

    def close(self) -> None:
        """Accepts no more messages; those that wait can still be taken."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
