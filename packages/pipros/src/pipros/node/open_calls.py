"""Groups of running calls, which other threads can interrupt."""

from __future__ import annotations

import threading
import time
from typing import Final, Protocol
from weakref import WeakSet

_POLL_S: Final = 0.005


class Interruptible(Protocol):
    """An interruptible wait for a peer."""

    def interrupt(self) -> None: ...

    def interrupt_present(self) -> None: ...


class OpenCalls:
    """A group of running calls that can be interrupted together. A group can be part of another group."""

    def __init__(self, part_of: OpenCalls | None = None) -> None:
        self._open: WeakSet[Interruptible] = WeakSet()
        self._callers: set[int] = set()
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

    def begin(self) -> None:
        """Record that the current thread is calling a service, until it calls `end`."""
        self._callers.add(threading.get_ident())

    def end(self) -> None:
        """Record that the current thread has finished its call."""
        self._callers.discard(threading.get_ident())

    def interrupt(self, grace_s: float = 0.0) -> None:
        """Interrupt all calls that do not end within `grace_s`, and all future calls."""
        self._wait_for_callers(grace_s)
        with self._lock:
            self._is_interrupted = True
            calls = list(self._open)
        for call in calls:
            call.interrupt()

    def interrupt_present(self, grace_s: float = 0.0) -> None:
        """Interrupt all calls that do not end within `grace_s`. Later calls are not affected."""
        self._wait_for_callers(grace_s)
        with self._lock:
            calls = list(self._open)
        for call in calls:
            call.interrupt_present()

    def _wait_for_callers(self, limit_s: float) -> None:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline and self._have_callers():
            time.sleep(_POLL_S)

    def _have_callers(self) -> bool:
        with self._lock:
            parts = [each for each in self._open if isinstance(each, OpenCalls)]
        return bool(self._callers) or any(part._have_callers() for part in parts)
