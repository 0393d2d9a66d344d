"""A launch child: starts nodes on this computer for a parent roslaunch on another computer.

This is Noetic's protocol. The parent logs in by ssh and starts `roslaunch -c NAME -u URI --run_id ID`. The
child opens an XML-RPC server and passes its URI to the parent's `register(NAME, URI)`. Once the master is
running, the parent calls `launch(XML)`; the response names the started nodes. From then on the child calls
`log(NAME, level, text)` and `process_died(process, exit code)`, until the parent calls `shutdown()` or exits,
or all nodes have exited.

A separate thread reports to the parent, so that a hanging or disconnected parent delays no node. If there is
nothing to report, the thread checks once a second whether the parent still answers.
"""

from __future__ import annotations

import asyncio
import os
import stat
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import get_within_slice
from pipros.basics.posix import user_id
from pipros.basics.uri import split_uri
from pipros.net.address import plain_address
from pipros.net.rpc_client import RpcClient
from pipros.net.this_machine import ThisMachineCaller, has_address, knows_users, user_listening
from pipros.wire.xmlrpc import Fault
from pipros_tools.launch.command import CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.logs import LauncherLog
from pipros_tools.launch.managed_node import ProcessInfo
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.run_id import is_run_id, new_run_id, run_id_problem
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.server import LaunchServer
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex


@dataclass(frozen=True, slots=True)
class _Order:
    """A call to `launch`, queued for the main thread, and the future for its response."""

    xml: str
    answer: Future[list[Any]]


class Child:
    """A launch child. Call `start`, `wait` and `stop`, in this order; call `stop` even if `start` fails."""

    def __init__(
        self,
        name: str,
        parent_uri: str,
        run_id: str,
        options: RunOptions,
        console: Console,
        *,
        environment: Environment | None = None,
        index: PackageIndex | None = None,
    ) -> None:
        """Validate the parent's URI.

        No connection is opened and no process is started until `start()` is called.

        Args:
            name: the parent's name for this child.

        Raises:
            LaunchError: the parent's URI is invalid.
        """
        self._environment = environment or Environment.from_os()
        self._index = index or PackageIndex.from_environment(self._environment)
        self._run_id = run_id
        self._options = options
        self._console = console
        self._link = ParentLink(name, parent_uri, self.request_stop)
        self._orders: SimpleQueue[_Order] = SimpleQueue()
        self._is_ordered = False
        self._is_stop_requested = False
        self._log: LauncherLog | None = None
        self._server: LaunchServer | None = None
        self._run: LaunchRun | None = None

    def start(self) -> None:
        """Open the log file and the server, and register with the parent.

        Raises:
            PiprosError, OSError: startup failed. Nothing is left running once `stop` has been called.
        """
        if not is_run_id(self._run_id):
            problem = run_id_problem(self._run_id, "--run_id")
            self._run_id = new_run_id()
            self._console.error(f"WARNING: {problem}. The log files of this run use a new id")
        self._log = LauncherLog.open(self._environment, self._run_id, self._console)
        server = LaunchServer(
            self._environment,
            self._processes,
            {"launch": self._answer_launch, "shutdown": self._answer_shutdown},
            admits=self._admits,
        )
        server.start()
        self._server = server
        self._console.bold(f"started roslaunch server {server.uri}")
        self._link.register(server.uri)
        self._console.relay_to(self._link.log)

    def wait(self) -> None:
        """Start the nodes that the parent requests, and watch them.

        Return when a stop is requested, a required node has exited, or all nodes have exited.
        """
        if self._log is None:
            raise RuntimeError("the child is not running; call start() first")
        while self._run is None and not self._is_stop_requested:
            order = get_within_slice(self._orders)
            if order is not None:
                self._launch(order, self._log)
        if self._run is not None:
            self._run.wait()

    def request_stop(self) -> None:
        """Make `wait` return. May be called repeatedly, from a signal handler or another thread."""
        self._is_stop_requested = True
        if self._run is not None:
            self._run.request_stop()

    def stop(self) -> None:
        """Stop the nodes, send pending reports to the parent, and disconnect.

        May be called even if nothing was started."""
        if self._run is not None:
            self._run.stop()
        if self._server is not None:
            self._server.stop()
        self._link.close()
        self._console.close()

    def _launch(self, order: _Order, log: LauncherLog) -> None:
        try:
            launch = load([], texts=[order.xml], context=LoadContext.of_process(self._index))
        except LaunchError as error:
            self._is_ordered = False
            order.answer.set_result([-1, f"ERROR: {error}", [[], []]])
            return
        self._console.say("launching nodes...")
        self._console.say(f"ROS_MASTER_URI={self._environment.master_uri}")
        run = LaunchRun(
            launch,
            CommandMaker.for_launcher(self._environment, self._index, log.file),
            master_uri=self._environment.master_uri,
            logs=log.folder,
            console=self._console,
            options=self._options,
            on_end=self._link.process_died,
        )
        self._run = run
        if self._is_stop_requested:
            run.request_stop()
        try:
            failed = run.start_nodes()
        except LaunchError as error:
            order.answer.set_result([0, f"ERROR: {error}", [[], []]])
            return
        self._console.say("... done launching nodes")
        order.answer.set_result([1, "launched", [[process.name for process in run.processes()], [*failed]]])

    def _processes(self) -> Sequence[ProcessInfo]:
        return self._run.processes() if self._run is not None else ()

    async def _answer_launch(self, xml: str) -> list[Any]:
        if self._is_ordered:
            return [-1, "ERROR: this roslaunch child has already launched its nodes", [[], []]]
        self._is_ordered = True
        order = _Order(xml, Future())
        self._orders.put(order)
        return await asyncio.wrap_future(order.answer)

    def _answer_shutdown(self) -> list[Any]:
        self.request_stop()
        return [1, "success", 1]

    def _admits(self, caller: ThisMachineCaller) -> bool:
        """Return whether a caller may connect.

        Access is restricted, because `launch` runs programs as this process's user. On this machine, only the
        parent's user, this process's user and root may connect. If the system does not report which user owns
        a connection, any user of this machine may connect, but only if the parent runs here. Other machines
        may connect from the addresses of the parent and of the ssh client that started this process.
        """
        parent = self._link.addresses
        if not caller.is_here:
            logged_in_from = os.environ.get("SSH_CLIENT", "").split()[:1]
            return caller.host in (*parent, *map(plain_address, logged_in_from))
        if knows_users():
            return caller.user_id() in {0, user_id(), self._link.user_id}
        return any(map(has_address, parent))


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
