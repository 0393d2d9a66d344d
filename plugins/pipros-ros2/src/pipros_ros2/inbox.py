"""Messages that wait for the thread that passes them on."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Final, Generic, TypeVar

ROS2_INBOX_BYTES = 256 * 1024 * 1024
"""Limit: the ROS 2 messages queued for one callback, or the requests queued for one service. Beyond it, the
oldest message is dropped and counted; a new request is refused, and the requests of a participant can use at
most half of the memory that other participants leave free.
"""

_Message = TypeVar("_Message")
OVERHEAD_BYTES: Final = 500
"""Memory that a waiting message takes in addition to its payload."""


class Inbox(Generic[_Message]):
    """Waiting messages. Beyond a limit, a new message replaces the oldest ones. Thread-safe.

    Args:
        depth: maximum number of messages; 0 for any number.
        cost: returns the memory that a message takes.

    Attributes:
        dropped: number of messages that were replaced.
    """

    def __init__(self, depth: int, limit_bytes: int, cost: Callable[[_Message], int]) -> None:
        self._depth = depth
        self._limit_bytes = limit_bytes
        self._cost = cost
        self._messages: deque[_Message] = deque()
        self._bytes = 0
        self._lock = threading.Lock()
        self.dropped = 0

    def __bool__(self) -> bool:
        return bool(self._messages)

    def push(self, message: _Message) -> bool:
        """Add a message. Return True if none was waiting: then the messages must be popped until None."""
        cost = self._cost(message)
        with self._lock:
            was_empty, waiting = not self._messages, self._messages
            while waiting and (
                (self._depth and len(waiting) >= self._depth) or self._bytes + cost > self._limit_bytes
            ):
                self._bytes -= self._cost(waiting.popleft())
                self.dropped += 1
            waiting.append(message)
            self._bytes += cost
            return was_empty

    def pop(self) -> _Message | None:
        """Return and remove the oldest message; None if there is none."""
        with self._lock:
            if not self._messages:
                return None
            message = self._messages.popleft()
            self._bytes -= self._cost(message)
            return message
