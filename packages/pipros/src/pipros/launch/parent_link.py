"""Send a launch child's reports to its parent roslaunch, in order and one at a time.

A separate thread makes the calls, so that a hanging or disconnected parent delays no node. If there is
nothing to report, the thread checks once a second whether the parent still answers.
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

from pipros.basics.errors import PiprosError
from pipros.basics.posix import user_id
from pipros.basics.uri import split_uri
from pipros.launch.model import LaunchError
from pipros.net.rpc_client import RpcClient
from pipros.net.this_machine import has_address, user_listening
from pipros.wire.xmlrpc import Fault

_INFO, _ERROR = 2, 8
"""Level numbers of rosgraph_msgs/Log."""

_CALL_TIMEOUT_S = 5.0
_CHECK_EVERY_S = 1.0
_LAST_CALLS_S = 1.0

# After this many consecutive refused connections, the parent is considered to have exited. A computer that
# does not answer at all may be temporarily out of range, as robots often are.
_REFUSALS = 3


class ParentLink:
    """The connection to the parent's XML-RPC server.

    Call `register` first. After that, `log` and `process_died` may be called from any thread. Neither blocks.
    """

    def __init__(self, name: str, uri: str, on_lost: Callable[[], None]) -> None:
        """Validate the URI. The connection is opened by `register`.

        Args:
            name: the parent's name for this child.
            on_lost: called from another thread, at most once, when the parent is considered to have exited.

        Raises:
            LaunchError: the URI is invalid.
        """
        try:
            self._client = RpcClient(uri, timeout_s=_CALL_TIMEOUT_S)
        except ValueError as error:
            raise LaunchError(f"invalid URI [{uri}] for the roslaunch parent: {error}") from None
        self._port = split_uri(uri)[1]
        self._user_id: int | None = None
        self._name = name
        self._uri = uri
        self._on_lost = on_lost
        self._calls: SimpleQueue[tuple[Any, ...] | None] = SimpleQueue()
        self._refusals = 0
        self._is_lost = False
        self._is_ssh_over = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="roslaunch parent", daemon=True)

    @property
    def addresses(self) -> tuple[str, ...]:
        """The parent's IP addresses; empty before `register`."""
        return self._client.server_addresses

    @property
    def user_id(self) -> int:
        """The user id of a parent on this machine; otherwise, or if it is unknown, this process's user id.

        Looked up only once, because another user may reuse the parent's port after the parent has exited.
        """
        if self._user_id is None:
            for host in filter(has_address, self.addresses):
                self._user_id = user_listening(host, self._port)
        return user_id() if self._user_id is None else self._user_id

    def register(self, uri: str) -> None:
        """Register this child's URI with the parent, and start reporting.

        Raises:
            LaunchError: the parent does not answer, or refuses this child.
        """
        try:
            code, text, _ = self._client.call("register", self._name, uri)
        except (PiprosError, Fault, TypeError, ValueError) as error:
            raise LaunchError(
                f"cannot register with the roslaunch parent [{self._uri}]: {error}. Check that this "
                "computer can reach that address, which is the parent's ROS_IP or ROS_HOSTNAME"
            ) from None
        if code != 1:
            raise LaunchError(f"unable to register with roslaunch parent [{self._uri}]: {text}")
        threading.Thread(target=self._watch_input, name="end of input", daemon=True).start()
        self._thread.start()

    def log(self, text: str, is_error: bool = False) -> None:
        """Queue a line for the parent's terminal."""
        self._calls.put(("log", self._name, _ERROR if is_error else _INFO, text))

    def process_died(self, process: str, exit_code: int) -> None:
        self._calls.put(("process_died", process, exit_code))

    def close(self) -> None:
        """Send the pending calls, waiting at most one second, then disconnect."""
        self._closing.set()
        self._calls.put(None)
        if self._thread.ident is not None:
            self._thread.join(_LAST_CALLS_S)
        self._client.close()

    def _run(self) -> None:
        while True:
            call: tuple[Any, ...] | None = ("get_pid",)
            with suppress(Empty):
                call = self._calls.get(timeout=_CHECK_EVERY_S)
            if call is None:
                return
            if not self._is_lost:
                self._make(*call)

    def _make(self, method: str, *params: Any) -> None:
        try:
            self._client.call(method, *params)
        except Fault:
            self._refusals = 0  # the parent answers, but lacks this method
        except PiprosError as error:
            is_refused = isinstance(error.__cause__, ConnectionRefusedError)
            self._refusals = self._refusals + 1 if is_refused else 0
            if self._refusals >= _REFUSALS or self._is_ssh_over.is_set() or self._closing.is_set():
                self._is_lost = True
                self._on_lost()
            elif is_refused:
                self._closing.wait(_CHECK_EVERY_S)
        else:
            self._refusals = 0

    def _watch_input(self) -> None:
        """Wait until standard input is closed, which means that ssh has exited.

        Return immediately if standard input is neither a pipe nor a socket.
        """
        with suppress(OSError, ValueError, AttributeError):
            number = sys.stdin.fileno()
            mode = os.fstat(number).st_mode
            if not (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)):
                return
            while os.read(number, 4096):
                pass
            self._is_ssh_over.set()
