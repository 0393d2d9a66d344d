"""An expensive query. Callers that request it while it runs share the result of the next run."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class SharedAnswer(Generic[T]):
    """Runs one query at a time, and drops its result when no caller waits any more. Thread-safe.

    Every call to `get` returns the result of a query that began after the call.
    """

    def __init__(self, query: Callable[[], T]) -> None:
        self._query = query
        self._lock = threading.Lock()
        self._newest: tuple[float, T] | None = None
        self._waiting = 0
        self._counting = threading.Lock()

    def get(self) -> T:
        """Return the result of a query. Blocks; raises the errors of the query."""
        asked_s = time.monotonic()
        with self._counting:
            self._waiting += 1
        try:
            with self._lock:
                newest = self._newest
                if newest is None or newest[0] < asked_s:
                    self._newest = None
                    newest = self._newest = time.monotonic(), self._query()
                return newest[1]
        finally:
            with self._counting:
                self._waiting -= 1
                if not self._waiting:
                    self._newest = None
