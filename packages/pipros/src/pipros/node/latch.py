"""The last messages from latching publishers, for callbacks that are added later."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any


class LastMessage:
    """The last message received over a latching publisher's link, initially None."""

    __slots__ = ("message",)

    def __init__(self) -> None:
        self.message: Any = None


class LatchedFirst:
    """Stand-in for a new callback. The callback receives the latched messages first, then newer messages.

    Messages that arrive in the links' threads while `give` runs are queued, and `give` passes them on.
    """

    def __init__(self, latched: Iterable[Any], call_back: Callable[[Any], object]) -> None:
        self._call_back = call_back
        self._waiting = deque(latched)
        self._is_over = False
        self._lock = threading.Lock()

    def __call__(self, message: Any) -> None:
        """Queue a message received over a link, or pass it on if `give` has finished."""
        with self._lock:
            if not self._is_over:
                self._waiting.append(message)
                return
        self._call_back(message)

    def give(self) -> None:
        """Call the callback with each queued message, in the caller's thread, until none are left."""
        while True:
            with self._lock:
                if not self._waiting:
                    self._is_over = True
                    return
                message = self._waiting.popleft()
            self._call_back(message)
