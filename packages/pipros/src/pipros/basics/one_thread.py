"""Threads, and Python without them: there, code for other threads runs where the only thread waits.

`turns` is None wherever Python has threads. A plugin that gives Python sockets in a browser sets it, before
other modules are used. No other module of the core looks at it: they call the functions below.
"""

from __future__ import annotations

import threading

TYPE_CHECKING = False  # type checkers treat this as True; this module is loaded by every node
if TYPE_CHECKING:
    import asyncio
    import socket
    from collections.abc import Callable
    from typing import Any, Protocol

    class OnlyThread(Protocol):
        """Runs the work of a process in its only thread. A turn runs everything that is due."""

        def wait(self, is_over: Callable[[], bool], timeout_s: float | None) -> bool:
            """Take turns until `is_over` returns True; return False if the timeout expires first."""

        def take_turn(self) -> None:
            """Take one turn, but not during a wait."""

        def later(self, job: Callable[..., object], *args: Any) -> None:
            """Call `job` in a later turn. The job may wait: other jobs then run inside of its wait."""

        def at_last(self, job: Callable[..., object], *args: Any) -> None:
            """Call `job` in the outermost wait. Jobs that wait end, if need be with SystemExit."""

        def while_ending(self, job: Callable[[], object]) -> None:
            """Call `job`. Jobs that wait inside of it soon end with SystemExit."""

        def drive(self, loop: asyncio.AbstractEventLoop) -> None:
            """Run an event loop's callbacks and timers in all turns until the loop is closed."""

        def read(self, sock: socket.socket, job: Callable[[], bool | None]) -> None:
            """Call `job` in each turn in which the socket can be read, until the socket is closed.

            It returns whether it has more to do, so that it is called in the next turn in any case, or None
            if it can do nothing until another job has ended.
            """

        def repeat(self, job: Callable[[], float | None]) -> None:
            """Call `job` in a later turn, then again after as many seconds as it returns; None ends this."""

        def publishing(self, publish: Callable[[Any], None]) -> Callable[[Any], None]:
            """Return a function that calls `publish`, and then takes a turn."""


turns: OnlyThread | None = None


def has_threads() -> bool:
    """Return whether Python has threads."""
    return turns is None


def start_thread(function: Callable[..., object], *args: Any, name: str) -> None:
    """Call a function in a new daemon thread; without threads, in a later turn."""
    if turns is None:
        threading.Thread(target=function, args=args, name=name, daemon=True).start()
    else:
        turns.later(function, *args)


def start_work(run: Callable[[], object], turn: Callable[[], float | None], *, name: str) -> None:
    """Call `run` in a new daemon thread; without threads, `turn` again and again: see `OnlyThread.repeat`."""
    if turns is None:
        start_thread(run, name=name)
    else:
        turns.repeat(turn)


def start_reader(sock: socket.socket, thread: threading.Thread, turn: Callable[[], bool | None]) -> None:
    """Start a thread to read a socket; without threads, call `turn` if readable: `OnlyThread.read`."""
    if turns is None:
        thread.start()
    else:
        sock.setblocking(False)
        turns.read(sock, turn)


def drive(loop: asyncio.AbstractEventLoop) -> bool:
    """Without threads, run an event loop in all turns. Return False if it needs a thread."""
    if turns is not None:
        turns.drive(loop)
    return turns is not None


def wait(is_over: Callable[[], bool], timeout_s: float | None) -> bool:
    """Without threads, take turns until `is_over` returns True. Return False on timeout, or with threads."""
    return turns is not None and turns.wait(is_over, timeout_s)


def later(job: Callable[..., object], *args: Any) -> None:
    """Call `job`; without threads, in a later turn."""
    if turns is None:
        job(*args)
    else:
        turns.later(job, *args)


def start_at_last(job: Callable[..., object], *args: Any, name: str) -> None:
    """Call `job`, which ends the program, in a new thread; without threads, in the outermost wait."""
    if turns is None:
        start_thread(job, *args, name=name)
    else:
        turns.at_last(job, *args)


def while_ending(job: Callable[[], object]) -> None:
    """Call `job`. Without threads, jobs that wait inside of it soon end with SystemExit."""
    if turns is None:
        job()
    else:
        turns.while_ending(job)


def publishing(publish: Callable[[Any], None]) -> Callable[[Any], None]:
    """Return `publish`; without threads, a function that takes a turn afterwards."""
    return publish if turns is None else turns.publishing(publish)


def take_turn() -> None:
    """Without threads, run what is due."""
    if turns is not None:
        turns.take_turn()
