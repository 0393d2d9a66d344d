"""A queue of values for a browser that may be slow."""

from __future__ import annotations

import threading
from collections import deque


class NewSamples:
    """Bounded queue of values to send. If the browser is slow, the oldest values are dropped."""

    def __init__(self, limit: int) -> None:
        self._lock = threading.Lock()
        self._values: deque[object] = deque(maxlen=limit)
        self._lost = 0

    def add(self, value: object) -> None:
        with self._lock:
            self._lost += len(self._values) == self._values.maxlen
            self._values.append(value)

    def lose(self) -> None:
        """Count a value that was skipped."""
        with self._lock:
            self._lost += 1

    def pop_all(self) -> tuple[list[object], int]:
        """Return the values added since the last call, and the number of lost values."""
        with self._lock:
            values, lost = list(self._values), self._lost
            self._values.clear()
            self._lost = 0
        return values, lost
