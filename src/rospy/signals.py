"""Ctrl-C and SIGTERM, which end the node whatever the main thread is doing."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from pipros.node import Node
from rospy.exceptions import ROSInitException

#: What a call of the handler adds to the number of its signal.
CALLED = 0x80

#: What a call of the handler told is told by the interpreter within this time, if at all.
TOLD_TWICE_S = 1.0


class Signals:
    """Takes SIGINT and SIGTERM over, once a process.

    Theory of operation. Python itself calls handlers only when the main thread runs Python code, so a
    signal that comes just before it begins to wait would be lost. The interpreter writes each signal's
    number to a descriptor at once, though, and the node's event loop reads it. Others may have that
    descriptor for a while (asyncio, matplotlib), or call our handler from one of their own; so the
    handler writes to the same descriptor, and what is told both ways counts once. Whoever puts a handler
    in the place of ours decides himself what a signal means.

    A forked child has the handlers that the process had before: it is not the node.
    """

    def __init__(self, end: Callable[[str], object]) -> None:
        """`end` is called with the reason, in a thread of its own, at the first signal."""
        self._end = end
        self._previous_handlers: dict[int, Any] = {}
        self._is_told_to_end = False
        self._told: set[int] = set()  # by the interpreter, and not by a call of the handler yet
        self._called: dict[int, float] = {}  # the other way round, and since when
        self._sockets: tuple[socket.socket, socket.socket]

    def take(self, node: Node) -> None:
        """Begins to listen, by the node's event loop.

        Raises:
            ROSInitException: this is not the main thread.
        """
        if threading.current_thread() is not threading.main_thread():
            raise ROSInitException(
                "init_node() must be called in the main thread, or with disable_signals=True: "
                "only the main thread can handle signals"
            )
        told, tell = socket.socketpair()
        told.setblocking(False)
        tell.setblocking(False)
        self._sockets = told, tell
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous_handlers[number] = signal.signal(number, self._handle)
        node.watch_descriptor(told, self._read)
        signal.set_wakeup_fd(tell.fileno(), warn_on_full_buffer=False)
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._give_back)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        """Our handler: called by Python in the main thread, or by a handler that took its place."""
        with contextlib.suppress(OSError):  # so many signals wait that this one changes nothing
            self._sockets[1].send(bytes((number | CALLED,)))
        previous = self._previous_handlers[number]
        if callable(previous) and previous is not signal.default_int_handler:
            with contextlib.suppress(KeyboardInterrupt):
                previous(number, frame)

    def _read(self) -> None:
        """Takes note of what was told. In the event loop."""
        for told in self._sockets[0].recv(64):
            number = told & ~CALLED
            if number not in self._previous_handlers:
                continue
            if told & CALLED:
                if number in self._told:
                    self._told.remove(number)
                    continue
                self._called[number] = time.monotonic()
            else:
                if signal.getsignal(number) != self._handle:
                    continue
                if time.monotonic() - self._called.pop(number, float("-inf")) < TOLD_TWICE_S:
                    continue
                self._told.add(number)
            self._tell_to_end(number)

    def _tell_to_end(self, number: int) -> None:
        """Ends the node in a thread of its own; a second signal ends the process at once.

        The main thread may be in the middle of anything, a publish for example, and may hold what
        the end needs, so the end does not run on top of it.
        """
        if self._is_told_to_end:
            os._exit(128 + number)
        self._is_told_to_end = True
        threading.Thread(
            target=self._end, args=(f"signal-{number}",), name="end of the node", daemon=True
        ).start()

    def _give_back(self) -> None:
        """In a forked child."""
        signal.set_wakeup_fd(-1)
        for number, previous in self._previous_handlers.items():
            if signal.getsignal(number) == self._handle:
                signal.signal(number, signal.SIG_DFL if previous is None else previous)
