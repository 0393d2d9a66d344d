"""An event queue that is processed by one thread."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable


class Events:
    """A bounded queue of callables. Thread-safe; only `next` blocks.

    An event replaces a queued event of the same kind and name.
    """

    def __init__(self, limit: int) -> None:
        """Create an empty queue. While `limit` events are queued, new events are dropped."""
        self._limit = limit
        self._waiting: OrderedDict[tuple[str, str], Callable[[], object]] = OrderedDict()
        self._changed = threading.Condition()
        self._is_closed = False

    def post(self, kind: str, name: str, event: Callable[[], object]) -> None:
        with self._changed:
            self._waiting.pop((kind, name), None)
            if len(self._waiting) < self._limit:
                self._waiting[kind, name] = event
            self._changed.notify()

    def wake(self) -> None:
        """Make `next` return, by queueing an event that does nothing."""
        self.post("wake", "", lambda: None)

    def next(self, timeout_s: float | None) -> Callable[[], object] | None:
        """Wait for an event and return it; return None after `timeout_s` or once the queue is closed."""
        with self._changed:
            if not self._waiting and not self._is_closed:
                self._changed.wait(timeout_s)
            return self._waiting.popitem(last=False)[1] if self._waiting and not self._is_closed else None

    @property
    def is_closed(self) -> bool:
        return self._is_closed

    def close(self) -> None:
        """Make `next` return None from now on."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
