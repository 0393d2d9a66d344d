"""A launch child: starts nodes on this computer for a parent roslaunch on another computer.

This is Noetic's protocol. The parent logs in by ssh and starts `roslaunch -c NAME -u URI --run_id ID`. The
child opens an XML-RPC server and passes its URI to the parent's `register(NAME, URI)`. Once the master is
running, the parent calls `launch(XML)`; the response names the started nodes. From then on the child calls
`log(NAME, level, text)` and `process_died(process, exit code)`, until the parent calls `shutdown()` or exits,
or all nodes have exited.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.interruptible_wait import get_within_slice
from pipros.basics.posix import user_id
from pipros.launch.command import CommandMaker
from pipros.launch.console import Console
from pipros.launch.load_context import LoadContext
from pipros.launch.logs import LauncherLog
from pipros.launch.managed_node import ProcessInfo
from pipros.launch.model import LaunchError
from pipros.launch.parent_link import ParentLink
from pipros.launch.run import LaunchRun, RunOptions
from pipros.launch.run_id import is_run_id, new_run_id, run_id_problem
from pipros.launch.server import LaunchServer
from pipros.launch.xml import load
from pipros.net.address import plain_address
from pipros.net.this_machine import ThisMachineCaller, has_address, knows_users
from pipros.workspace.index import PackageIndex


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
        order.answer.set_result([1, "launched", [[process.name for process in run.processes()], failed]])

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
