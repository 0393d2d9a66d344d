"""The last message of publishers that latch, for callbacks that are added later."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any


class LastMessage:
    """The last message that came over one link from a publisher that latches; None before the first."""

    __slots__ = ("message",)

    def __init__(self) -> None:
        self.message: Any = None


class LatchedFirst:
    """Stands in for a new callback until it has had the latched messages, which come before newer ones.

    Messages that arrive meanwhile, from the threads of links, wait; `give` calls back with them too.
    """

    def __init__(self, latched: Iterable[Any], call_back: Callable[[Any], object]) -> None:
        self._call_back = call_back
        self._waiting = deque(latched)
        self._is_over = False
        self._lock = threading.Lock()

    def __call__(self, message: Any) -> None:
        """A message from a link."""
        with self._lock:
            if not self._is_over:
                self._waiting.append(message)
                return
        self._call_back(message)

    def give(self) -> None:
        """Calls back with what waits, in the thread of the caller, until nothing does."""
        while True:
            with self._lock:
                if not self._waiting:
                    self._is_over = True
                    return
                message = self._waiting.popleft()
            self._call_back(message)
