"""An expensive query. Callers that request the same while it runs share the result of the next run."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

K = TypeVar("K")
T = TypeVar("T")


class SharedAnswer(Generic[K, T]):
    """Runs one query at a time, and drops its result when no caller waits any more. Thread-safe.

    Every call to `get` returns the result of a query with the same key that began after the call.
    """

    def __init__(self, query: Callable[[K], T]) -> None:
        self._query = query
        self._lock = threading.Lock()
        self._newest: tuple[float, K, T] | None = None
        self._waiting = 0
        self._counting = threading.Lock()

    def get(self, key: K) -> T:
        """Return the result of a query. Blocks; raises the errors of the query."""
        asked_s = time.monotonic()
        with self._counting:
            self._waiting += 1
        try:
            with self._lock:
                newest = self._newest
                if newest is None or newest[0] < asked_s or newest[1] != key:
                    self._newest = None
                    newest = self._newest = time.monotonic(), key, self._query(key)
                return newest[2]
        finally:
            with self._counting:
                self._waiting -= 1
                if not self._waiting:
                    self._newest = None
