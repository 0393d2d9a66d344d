"""Watches all parameters while a client subscribes to any. The master notifies the node of every change."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros_bridges.foxglove.parameters import flattened

PAUSE_S: Final = 0.1
"""Minimum time between two queries of the master, however often parameters change."""

Changes = Mapping[str, Any]
"""New values by name. A deleted parameter has the value `DELETED`."""
DELETED: Final = object()


class ParameterWatch:
    """Queries all parameters in a thread after each change, and reports the differences."""

    def __init__(self, node: Node, on_changes: Callable[[Changes], object]) -> None:
        """Create a watch that is not running. `on_changes` is called in the watch's thread."""
        self._node = node
        self._on_changes = on_changes
        self._is_dirty = threading.Event()
        self._is_closed = threading.Event()
        self._is_needed = False
        self._is_started = False

    def set_needed(self, is_needed: bool) -> None:
        """Start or stop watching. Does not block."""
        if is_needed == self._is_needed:
            return
        self._is_needed = is_needed
        self._is_dirty.set()
        if not self._is_started:
            self._is_started = True
            threading.Thread(target=self._run, name="parameter watch", daemon=True).start()

    def close(self) -> None:
        """Signal the thread to stop, without waiting for it."""
        self._is_closed.set()
        self._is_dirty.set()

    def _run(self) -> None:
        self._node.params.observe(self._is_dirty.set)
        known: dict[str, Any] | None = None  # None while the watch is not needed
        while not self._is_closed.is_set():
            self._is_dirty.clear()
            found = self._query(known) if self._is_needed else None
            if known is not None and found is not None and (changes := _differences(known, found)):
                self._on_changes(changes)
            known = found
            self._is_closed.wait(PAUSE_S)
            self._is_dirty.wait()

    def _query(self, known: dict[str, Any] | None) -> dict[str, Any]:
        try:
            self._node.params.get_cached("/")  # the first call subscribes to changes
            return flattened(self._node.params.get("/"))
        except (PiprosError, OSError):  # the master is not available
            return known or {}


def _differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    changed = {name: value for name, value in after.items() if name not in before or before[name] != value}
    return changed | {name: DELETED for name in before if name not in after}
