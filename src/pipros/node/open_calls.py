"""Groups of running calls, which other threads can interrupt."""

from __future__ import annotations

import threading
from typing import Protocol
from weakref import WeakSet


class Interruptible(Protocol):
    """An interruptible wait for a peer."""

    def interrupt(self) -> None: ...

    def interrupt_present(self) -> None: ...


class OpenCalls:
    """A group of running calls that can be interrupted together. A group can be part of another group."""

    def __init__(self, part_of: OpenCalls | None = None) -> None:
        self._open: WeakSet[Interruptible] = WeakSet()
        self._lock = threading.Lock()
        self._is_interrupted = False
        if part_of is not None:
            part_of.add(self)

    def add(self, call: Interruptible) -> None:
        with self._lock:
            self._open.add(call)
            is_too_late = self._is_interrupted
        if is_too_late:
            call.interrupt()

    def remove(self, call: Interruptible) -> None:
        with self._lock:
            self._open.discard(call)

    def interrupt(self) -> None:
        """Interrupt all running and future calls."""
        with self._lock:
            self._is_interrupted = True
            calls = list(self._open)
        for call in calls:
            call.interrupt()

    def interrupt_present(self) -> None:
        """Interrupt all running calls. Later calls are not affected."""
        with self._lock:
            calls = list(self._open)
        for call in calls:
            call.interrupt_present()
