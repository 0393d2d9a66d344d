"""Python without threads: code that other systems run in threads runs where the only thread waits.

`turns` is None wherever Python has threads. A room that gives Python sockets in a browser sets it, before
other modules are used. Modules that wait, or start threads, then use it instead.
"""

from __future__ import annotations

import threading

TYPE_CHECKING = False  # type checkers treat this as True; this module is loaded by every node
if TYPE_CHECKING:
    import asyncio
    import socket
    from collections.abc import Callable
    from typing import Any, Protocol

    class Turns(Protocol):
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


turns: Turns | None = None


def start_thread(function: Callable[..., object], *args: Any, name: str) -> None:
    """Call a function in a new daemon thread; without threads, in a later turn."""
    if turns is None:
        threading.Thread(target=function, args=args, name=name, daemon=True).start()
    else:
        turns.later(function, *args)


def take_turn() -> None:
    """Without threads, run what is due."""
    if turns is not None:
        turns.take_turn()
