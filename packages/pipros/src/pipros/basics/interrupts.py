"""Handle signals that end a command: Ctrl-C, even if Python would ignore it, and SIGTERM with clean-up.

Python raises KeyboardInterrupt wherever the main thread is executing. In a `__del__`, or in a callback of the
garbage collector, which can run during any import, Python can only report the exception as ignored, and the
program continues. The hook that reports it therefore sends SIGINT again, from another thread, because an
exception inside the hook would be ignored as well.

After a KeyboardInterrupt in `Thread.start`, the new thread may not run until the exiting interpreter has
freed the thread's state, which crashes Python 3.11. The exiting program therefore waits for such threads.
"""

from __future__ import annotations

import _thread
import atexit
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import Any, ParamSpec

from pipros.basics.windows import call_when_console_closes

_Arguments = ParamSpec("_Arguments")

ENDING_SIGNALS: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM)
"""The signals that ask a program to end. A launcher on Windows sends SIGBREAK; see `posix.interrupt`."""
if sys.platform == "win32":
    ENDING_SIGNALS += (signal.SIGBREAK,)

_AGAIN_S = 0.02
"""The delay before SIGINT is sent again, so that the hook has finished by then."""

_STARTING_LIMIT_S = 0.3
"""Maximum time that the exiting program waits for threads that are starting."""


def install() -> None:
    """Make every Ctrl-C interrupt the program, even during a `__del__` method. May be called repeatedly."""
    if not isinstance(sys.unraisablehook, _InterruptKeeper):
        sys.unraisablehook = _InterruptKeeper(sys.unraisablehook)
        atexit.register(_wait_for_starting_threads)
        if sys.platform == "win32" and threading.current_thread() is threading.main_thread():
            if signal.getsignal(signal.SIGBREAK) is signal.SIG_DFL:
                signal.signal(signal.SIGBREAK, signal.default_int_handler)
            call_when_console_closes(interrupt_main_thread)


def accept_ctrl_c() -> None:
    """Make SIGINT raise KeyboardInterrupt, even if the process was started with SIGINT ignored.

    Shells start background jobs of scripts (`command &`) in this way. Noetic's commands that are ROS nodes
    nevertheless end on SIGINT; other commands keep ignoring it. Do nothing outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def is_interrupt(error: BaseException) -> bool:
    """Return whether Ctrl-C caused an error.

    Before 3.12, Python wraps the KeyboardInterrupt that ends a `__set_name__`, as of each field of a
    dataclass, in a RuntimeError.
    """
    return isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)


def exits_after_ctrl_c(code: int = 0) -> Callable[[Callable[_Arguments, int]], Callable[_Arguments, int]]:
    """Decorate a node program's `main`, so that it ends without a traceback when Ctrl-C interrupts it.

    This includes the KeyboardInterrupts that rospy raises, for example in `init_node`.

    Args:
        code: the exit code; 0 for a node, which runs until it is terminated.
    """

    def decorate(main: Callable[_Arguments, int]) -> Callable[_Arguments, int]:
        @wraps(main)
        def guarded(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> int:
            try:
                return main(*args, **kwargs)
            except (KeyboardInterrupt, RuntimeError) as error:
                if not is_interrupt(error):
                    raise
                return code

        return guarded

    return decorate


@contextmanager
def ended_by_termination() -> Iterator[None]:
    """End the block with SystemExit on SIGTERM, or on SIGHUP from a closed terminal, so that it can clean up.

    The exit code is the one that shells report for the signal. A signal that is ignored, as under nohup,
    stays ignored. Do nothing outside the main thread.
    """
    previous: dict[signal.Signals, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):  # no system has all of these signals
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                previous[number] = signal.signal(number, _exit_by_signal)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def forget_handlers() -> None:
    """Let ending signals end this process at once, before another program replaces it.

    A handler in Python is called after a signal has been noted, and the note is lost with the process's
    memory: of programs that `rosrun` starts, one in some dozens went on after Ctrl-C at that moment.
    """
    for number in ENDING_SIGNALS:
        if callable(signal.getsignal(number)):  # an ignored signal stays ignored
            signal.signal(number, signal.SIG_DFL)


def _exit_by_signal(number: int, _: FrameType | None) -> None:
    raise SystemExit(128 + number)


class _InterruptKeeper:
    """An `unraisablehook` that interrupts the main thread again after a KeyboardInterrupt.

    Other exceptions are passed to the previous hook.
    """

    def __init__(self, report: Callable[[Any], object]) -> None:
        self._report = report

    def __call__(self, unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            _thread.start_new_thread(_interrupt_again, ())
        else:
            self._report(unraisable)


def _interrupt_again() -> None:
    time.sleep(_AGAIN_S)
    interrupt_main_thread()


def _wait_for_starting_threads() -> None:
    end = time.monotonic() + _STARTING_LIMIT_S
    while any(thread.ident is None for thread in threading.enumerate()) and time.monotonic() < end:
        time.sleep(0.001)


def interrupt_main_thread() -> None:
    """Run the SIGINT handler in the main thread, even if that thread is waiting for a lock or for input."""
    main = threading.main_thread().ident
    if sys.platform != "win32" and main is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, signal.SIGINT)  # also interrupts a blocking system call
    else:
        signal.raise_signal(signal.SIGINT)  # unlike _thread.interrupt_main(), wakes time.sleep()
