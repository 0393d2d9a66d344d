"""Query nodes in separate threads, because a node may not respond."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Hashable
from typing import Any, Final

from pipros.net.workers import Workers

RETRY_S: Final = 10.0
"""Minimum time between queries with the same key. The old result is used until the new one arrives."""
_AT_ONCE: Final = 64
_LOG = logging.getLogger("pipros_tools.graph")


class NodeQueries:
    """Runs queries, and keeps the last result for each key. Thread-safe.

    A node that does not respond delays only queries with the same key, as long as fewer than `_AT_ONCE`
    queries are waiting for a response.
    """

    def __init__(self, name: str, *, retry_s: float = RETRY_S) -> None:
        self._workers = Workers(name, _AT_ONCE)
        self._retry_s = retry_s
        self._answers: dict[Hashable, Any] = {}
        self._asked_s: dict[Hashable, float] = {}
        self._running: set[Hashable] = set()
        self._changed = threading.Condition()
        self._is_closed = False

    def ask(self, key: Hashable, query: Callable[[], Any]) -> None:
        """Start a query, unless one with this key is running or recent. A result of None is ignored."""
        with self._changed:
            age_s = time.monotonic() - self._asked_s.get(key, -self._retry_s)
            if key in self._running or age_s < self._retry_s:
                return
            self._running.add(key)
        self._workers.run(self._run, key, query)

    def _run(self, key: Hashable, query: Callable[[], Any]) -> None:
        answer = None
        try:
            answer = query()
        except Exception:
            if not self._is_closed:
                _LOG.exception("a query to a node failed: %s", key)
        finally:
            with self._changed:
                self._running.discard(key)
                self._asked_s[key] = time.monotonic()
                if answer is not None:
                    self._answers[key] = answer
                self._changed.notify_all()

    @property
    def is_running(self) -> bool:
        """Whether a query has not ended."""
        return bool(self._running)

    def wait(self, timeout_s: float) -> bool:
        """Wait until no query is running; return False after the timeout."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._running, timeout_s)

    def answer(self, key: Hashable) -> Any:
        """Return the latest result for a key, or None."""
        return self._answers.get(key)

    def forget_all_but(self, is_kept: Callable[[Any], bool]) -> None:
        """Forget the keys for which `is_kept` returns False."""
        with self._changed:
            for table in (self._answers, self._asked_s):
                for key in [key for key in table if not is_kept(key)]:
                    del table[key]

    def close(self) -> None:
        """End the idle threads, and ignore failures of running queries."""
        self._is_closed = True
        self._workers.close()
