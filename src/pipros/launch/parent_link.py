"""What the far side of a launch tells the roslaunch that ordered it: one call after another, in order.

A thread of its own makes the calls, so that a parent that hangs or is cut off delays no node. While there
is nothing to tell, it asks now and then whether the parent is still there.
"""

from __future__ import annotations

import os
import stat
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from pipros.errors import PiprosError
from pipros.launch.model import LaunchError
from pipros.net.rpc import RpcClient
from pipros.wire.xmlrpc import Fault

_INFO, _ERROR = 2, 8
"""Levels as in rosgraph_msgs/Log."""

_CALL_TIMEOUT_S = 5.0
_ASK_EVERY_S = 1.0
_LAST_WORDS_S = 1.0

# A computer that says that nobody listens there is believed when it says so again; one that is silent may
# be out of reach for a while, as robots are.
_REFUSALS = 3


class ParentLink:
    """The connection to the parent's XML-RPC server.

    `register` first; then `log` and `process_died`, from any thread; they return at once.
    """

    def __init__(self, name: str, uri: str, on_lost: Callable[[], None]) -> None:
        """Nothing is connected yet.

        Args:
            name: what the parent calls this side.
            on_lost: called once, from another thread, when the parent has ended.

        Raises:
            LaunchError: the URI is none.
        """
        try:
            self._client = RpcClient(uri, timeout_s=_CALL_TIMEOUT_S)
        except ValueError as error:
            raise LaunchError(f"the URI of the roslaunch parent [{uri}] is none: {error}") from None
        self._name = name
        self._uri = uri
        self._on_lost = on_lost
        self._calls: SimpleQueue[tuple[Any, ...] | None] = SimpleQueue()
        self._refusals = 0
        self._is_lost = False
        self._is_ssh_over = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="roslaunch parent", daemon=True)

    def register(self, uri: str) -> None:
        """Tells the parent where this side answers, and begins to tell it more.

        Raises:
            LaunchError: the parent is not there, or does not know this side.
        """
        try:
            code, text, _ = self._client.call("register", self._name, uri)
        except (PiprosError, Fault, TypeError, ValueError) as error:
            raise LaunchError(
                f"cannot register with the roslaunch parent [{self._uri}]: {error}. Can this computer reach "
                "that address? It is the ROS_IP or ROS_HOSTNAME of the other one"
            ) from None
        if code != 1:
            raise LaunchError(f"unable to register with roslaunch parent [{self._uri}]: {text}")
        threading.Thread(target=self._watch_input, name="end of input", daemon=True).start()
        self._thread.start()

    def log(self, text: str, is_error: bool = False) -> None:
        """A line for the parent's terminal."""
        self._calls.put(("log", self._name, _ERROR if is_error else _INFO, text))

    def process_died(self, process: str, exit_code: int) -> None:
        self._calls.put(("process_died", process, exit_code))

    def close(self) -> None:
        """Tells what is left to tell, within a second, and disconnects."""
        self._closing.set()
        self._calls.put(None)
        if self._thread.ident is not None:
            self._thread.join(_LAST_WORDS_S)
        self._client.close()

    def _run(self) -> None:
        while True:
            call: tuple[Any, ...] | None = ("get_pid",)
            with suppress(Empty):
                call = self._calls.get(timeout=_ASK_EVERY_S)
            if call is None:
                return
            if not self._is_lost:
                self._make(*call)

    def _make(self, method: str, *params: Any) -> None:
        try:
            self._client.call(method, *params)
        except Fault:
            self._refusals = 0  # it is there, and has no such method
        except PiprosError as error:
            is_refused = isinstance(error.__cause__, ConnectionRefusedError)
            self._refusals = self._refusals + 1 if is_refused else 0
            if self._refusals >= _REFUSALS or self._is_ssh_over.is_set() or self._closing.is_set():
                self._is_lost = True
                self._on_lost()
            elif is_refused:
                self._closing.wait(_ASK_EVERY_S)
        else:
            self._refusals = 0

    def _watch_input(self) -> None:
        """Takes note of the end of standard input, when that is a connection: it is the end of ssh's."""
        with suppress(OSError, ValueError, AttributeError):
            number = sys.stdin.fileno()
            mode = os.fstat(number).st_mode
            if not (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)):
                return
            while os.read(number, 4096):
                pass
            self._is_ssh_over.set()
