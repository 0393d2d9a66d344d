"""Groups of running calls, which other threads can interrupt.

There is no lock: the finalizer of a client removes its calls, at any moment and in any thread, even in one
that is in the middle of these functions. Single operations on sets are atomic.
"""

from __future__ import annotations

import threading
import time
from typing import Final, Protocol
from weakref import ref

_POLL_S: Final = 0.005


class Interruptible(Protocol):
    """An interruptible wait for a peer."""

    def interrupt(self) -> None: ...

    def interrupt_present(self) -> None: ...


class OpenCalls:
    """A group of running calls that can be interrupted together. A group can be part of another group."""

    def __init__(self, part_of: OpenCalls | None = None) -> None:
        self._open: set[ref[Interruptible]] = set()
        self._callers: set[int] = set()
        self._is_interrupted = False
        if part_of is not None:
            part_of.add(self)

    def add(self, call: Interruptible) -> None:
        self._open.add(ref(call, self._open.discard))
        if self._is_interrupted:
            call.interrupt()

    def remove(self, call: Interruptible) -> None:
        self._open.discard(ref(call))

    def begin(self) -> None:
        """Record that the current thread is calling a service, until it calls `end`."""
        self._callers.add(threading.get_ident())

    def end(self) -> None:
        """Record that the current thread has finished its call."""
        self._callers.discard(threading.get_ident())

    def interrupt(self, grace_s: float = 0.0) -> None:
        """Interrupt all calls that do not end within `grace_s`, and all future calls."""
        self._wait_for_callers(grace_s)
        self._is_interrupted = True  # before the calls are listed, so that `add` interrupts any later one
        for call in self._present():
            call.interrupt()

    def interrupt_present(self, grace_s: float = 0.0) -> None:
        """Interrupt all calls that do not end within `grace_s`. Later calls are not affected."""
        self._wait_for_callers(grace_s)
        for call in self._present():
            call.interrupt_present()

    def _wait_for_callers(self, limit_s: float) -> None:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline and self._have_callers():
            time.sleep(_POLL_S)

    def _have_callers(self) -> bool:
        parts = (each for each in self._present() if isinstance(each, OpenCalls))
        return bool(self._callers) or any(part._have_callers() for part in parts)

    def _present(self) -> list[Interruptible]:
        return [call for each in self._open.copy() if (call := each()) is not None]
