"""Ctrl-C and SIGTERM, which end the node whatever the main thread is doing."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

from pipros.node import Node
from rospy.exceptions import ROSInitException


class Signals:
    """Takes SIGINT and SIGTERM over, once a process.

    Python itself looks at signals only when the main thread runs Python code, so one that comes
    just before it begins to wait would be lost. The interpreter writes each signal's number to a
    descriptor at once, though, and the node's event loop reads it.
    """

    def __init__(self, end: Callable[[str], object]) -> None:
        """`end` is called with the reason, in a thread of its own, at the first signal."""
        self._end = end
        self._previous_handlers: dict[int, Any] = {}
        self._is_told_to_end = False
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
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous_handlers[number] = signal.signal(number, self._call_previous_handler)
        told, tell = socket.socketpair()
        told.setblocking(False)
        tell.setblocking(False)
        self._sockets = told, tell
        node.watch_descriptor(told, self._read)
        signal.set_wakeup_fd(tell.fileno(), warn_on_full_buffer=False)
        if hasattr(os, "register_at_fork"):  # a child's signals are not ours
            os.register_at_fork(after_in_child=lambda: signal.set_wakeup_fd(-1))

    def _read(self) -> None:
        """Ends the node in a thread of its own; a second signal ends the process at once.

        The main thread may be in the middle of anything, a publish for example, and may hold what
        the end needs, so the end does not run on top of it.
        """
        for number in self._sockets[0].recv(64):
            if number not in self._previous_handlers:
                continue
            if self._is_told_to_end:
                os._exit(128 + number)
            self._is_told_to_end = True
            threading.Thread(
                target=self._end, args=(f"signal-{number}",), name="end of the node", daemon=True
            ).start()

    def _call_previous_handler(self, number: int, frame: FrameType | None) -> None:
        previous = self._previous_handlers.get(number)
        if callable(previous) and previous is not signal.default_int_handler:
            with contextlib.suppress(KeyboardInterrupt):
                previous(number, frame)
