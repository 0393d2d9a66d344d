"""Subscribe to a node's inputs only while an output has subscribers."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol


class _Handle(Protocol):
    def unregister(self) -> None: ...


class _Closable(Protocol):
    def close(self) -> None: ...


class LazyInputs:
    """Subscribes while any of the outputs has subscribers. Callbacks may run in several threads."""

    def __init__(self, outputs: Iterable[Any], subscribe: Callable[[], Sequence[_Handle]]) -> None:
        """Watch the outputs.

        Args:
            outputs: publishers.
            subscribe: called when the first subscriber connects; returns the subscriptions.
        """
        self._outputs = list(outputs)
        self._subscribe = subscribe
        self._inputs: Sequence[_Handle] | None = None
        self._is_closed = False
        self._lock = threading.Lock()
        for each in self._outputs:
            each.publication.listeners.append(self)
        self._update()

    def peer_subscribe(self, *_: Any) -> None:
        """Handle a new subscriber of an output."""
        self._update()

    def peer_unsubscribe(self, *_: Any) -> None:
        """Handle the end of a subscriber's connection."""
        self._update()

    def close(self) -> None:
        """Unsubscribe, and stop watching the outputs."""
        self._is_closed = True
        for each in self._outputs:
            if self in each.publication.listeners:
                each.publication.listeners.remove(self)
        self._update()

    def _update(self) -> None:
        with self._lock:
            is_wanted = not self._is_closed and any(each.connection_count for each in self._outputs)
            if is_wanted and self._inputs is None:
                self._inputs = self._subscribe()
            elif not is_wanted and self._inputs is not None:
                inputs, self._inputs = self._inputs, None
                for each in inputs:
                    each.unregister()


class LazyNode:
    """Base of nodes whose `_inputs` are subscribed to only while an output has subscribers."""

    _inputs: _Closable

    def close(self) -> None:
        """Unsubscribe."""
        self._inputs.close()
