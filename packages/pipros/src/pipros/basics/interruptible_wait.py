"""Waits that any signal can interrupt.

Python runs signal handlers between two bytecode instructions of the main thread. A signal that arrives just
before that thread starts to wait is handled only after the wait, so an endless wait would lose Ctrl-C.
Therefore, every wait in the main thread consists of short slices.

A handler may also raise KeyboardInterrupt between any two bytecode instructions. `threading.Event` is written
in Python, so an exception in the middle of its `wait` can leave its lock held, and then `set` blocks forever.
`set` also blocks when it is called by a handler that interrupts `wait`. `OnceEvent` has neither problem.
"""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import TypeVar

from pipros.basics import one_thread
from pipros.basics.interrupts import ENDING_SIGNALS

SLICE_S = 0.2
_POLL_INTERVAL_S = 0.05

_Item = TypeVar("_Item")


class OnceEvent:
    """An event that can be set once, and stays usable if a signal handler raises an exception during `wait`.

    `set` never blocks, so signal handlers may call it.
    """

    __slots__ = ("_is_set", "_lock")

    def __init__(self) -> None:
        self._is_set = False
        self._lock = threading.Lock()  # locked until the event is set
        self._lock.acquire()

    def is_set(self) -> bool:
        return self._is_set

    def set(self) -> None:
        """Set the event, which ends all waits. May be called repeatedly."""
        self._is_set = True
        self._release()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait in slices until the event is set; return False if the timeout expires first."""
        return self._is_set or wait_in_slices(self._wait_once, timeout_s)

    def _wait_once(self, timeout_s: float) -> bool:
        if not self._is_set and self._lock.acquire(timeout=timeout_s):
            # wake the next waiting thread; after an exception here, that thread wakes one slice later
            self._release()
        return self._is_set

    def _release(self) -> None:
        with contextlib.suppress(RuntimeError):  # another thread has released the lock
            self._lock.release()


@contextlib.contextmanager
def set_by_signals(over: OnceEvent) -> Iterator[None]:
    """Set `over` on the first SIGINT or SIGTERM, and let the second one end the process.

    Does nothing outside the main thread.
    """

    def end(*_: object) -> None:
        for number in ENDING_SIGNALS:
            signal.signal(number, signal.SIG_DFL)
        over.set()

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = [(number, signal.signal(number, end)) for number in ENDING_SIGNALS]
    try:
        yield
    finally:
        for number, handler in previous:
            signal.signal(number, handler)


class ProgramLife:
    """The lifetime of a program whose main thread only waits, so that nothing delays its signal handlers.

    Attributes:
        over: set by SIGINT, SIGTERM, or the program itself.
    """

    def __init__(self) -> None:
        self.over = OnceEvent()
        self._interrupts: list[Callable[[], object]] = []

    @contextlib.contextmanager
    def interrupted_by(self, interrupt: Callable[[], object]) -> Iterator[None]:
        """Call `interrupt` in another thread if the program is asked to end during the block.

        Intended for blocks that may wait for a peer, such as the master, and do not check `over`.
        """
        self._interrupts.append(interrupt)
        try:
            yield
        finally:
            with contextlib.suppress(ValueError):
                self._interrupts.remove(interrupt)

    def interrupt(self) -> None:
        """Call the `interrupt` functions of all running blocks, once each."""
        while self._interrupts:
            interrupt = self._interrupts.pop()
            threading.Thread(target=interrupt, name="interrupts the start", daemon=True).start()


def run_until_signalled(program: Callable[[ProgramLife], _Item], *, grace_s: float = 1.0) -> _Item | None:
    """Run `program` in a thread, while this thread waits for it and for signals; return its result.

    The first SIGINT or SIGTERM sets `over`; the program then has `grace_s` to return. If it takes longer, the
    result is None, and the program's daemon thread keeps running. Exceptions that the program raises are
    raised here.
    """
    life = ProgramLife()
    results: list[_Item] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(program(life))
        except BaseException as error:  # raised in the waiting thread
            errors.append(error)
        finally:
            life.over.set()

    with set_by_signals(life.over):
        thread = threading.Thread(target=run, name="program", daemon=True)
        (thread.start if one_thread.has_threads() else run)()
        life.over.wait()
        end_s = time.monotonic() + grace_s
        while thread.is_alive() and time.monotonic() < end_s:
            life.interrupt()
            thread.join(_POLL_INTERVAL_S)
    if errors:
        raise errors[0]
    return results[0] if results else None


def wait_in_slices(wait_for: Callable[[float], bool], timeout_s: float | None = None) -> bool:
    """Wait in slices with `wait_for`, such as `event.wait`; return False if the timeout expires first."""
    if not one_thread.has_threads():
        return one_thread.wait(lambda: wait_for(0.0), timeout_s)
    if timeout_s is not None and timeout_s <= SLICE_S:
        return wait_for(max(timeout_s, 0))
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        left_s = SLICE_S if end is None else min(SLICE_S, end - time.monotonic())
        if wait_for(max(left_s, 0)):
            return True
        if end is not None and time.monotonic() >= end:
            return False


def get_within_slice(queue: SimpleQueue[_Item], timeout_s: float = SLICE_S) -> _Item | None:
    """Return the next item of a queue, or None after the timeout, which is limited to one slice."""
    limit_s = max(0.0, min(SLICE_S, timeout_s))
    if not one_thread.has_threads():
        one_thread.wait(lambda: not queue.empty(), limit_s)
        limit_s = 0.0
    try:
        return queue.get(timeout=limit_s)
    except Empty:
        return None
