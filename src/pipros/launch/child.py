"""The far side of another roslaunch: starts nodes on this computer by order of a parent on another one.

This is Noetic's protocol. The parent logs in by ssh and starts `roslaunch -c NAME -u URI --run_id ID`. The
child opens an XML-RPC server and calls `register(NAME, its URI)` at the parent's; the parent, once its
master runs, calls `launch(XML)` and is told which nodes were started. From then on the child reports by
`log(NAME, level, text)` and `process_died(process, exit code)`, until the parent calls `shutdown()`, is
gone, or all nodes have ended.
"""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from pipros.env import Environment
from pipros.launch.command import CommandMaker
from pipros.launch.console import Console
from pipros.launch.logs import LogFolder
from pipros.launch.model import LaunchError
from pipros.launch.parent_link import ParentLink
from pipros.launch.report import ProcessReport
from pipros.launch.run import Run, RunOptions
from pipros.launch.server import LaunchServer
from pipros.launch.surroundings import Surroundings
from pipros.launch.xml import load
from pipros.net.address import is_loopback, plain_address
from pipros.wire.uri import split_uri
from pipros.workspace.index import PackageIndex

# As everywhere: a signal may be noticed only when a wait of the main thread ends.
_LONGEST_WAIT_S = 0.2


@dataclass(frozen=True, slots=True)
class _Order:
    """A call of `launch`, on its way to the main thread, and its answer on the way back."""

    xml: str
    answer: Future[list[Any]]


class Child:
    """`start`, `wait`, `stop`, in this order; `stop` always."""

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
        """Nothing is started yet.

        Args:
            name: what the parent calls this side.

        Raises:
            LaunchError: the parent's URI is none.
        """
        self._environment = environment or Environment.from_os()
        self._index = index or PackageIndex.from_environment(self._environment)
        self._run_id = run_id
        self._options = options
        self._console = console
        self._link = ParentLink(name, parent_uri, self.request_stop)
        self._employers = _addresses_of_parent(parent_uri)
        self._orders: SimpleQueue[_Order] = SimpleQueue()
        self._is_ordered = False
        self._is_unwanted = False
        self._server: LaunchServer | None = None
        self._run: Run | None = None

    def start(self) -> None:
        """Opens log file and server, and registers with the parent.

        Raises:
            PiprosError, OSError: with nothing left running, once `stop` was called.
        """
        self._logs = LogFolder.of_run(self._environment, self._run_id)
        self._logs.check_writable()
        self._log = self._logs.file_of_launcher()
        self._console.open_log(self._log)
        self._console.say(f"... logging to {self._log}")
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
        """Starts what the parent orders. Returns when all of it has ended, or it is time to stop."""
        while self._run is None and not self._is_unwanted:
            with suppress(Empty):
                self._carry_out(self._orders.get(timeout=_LONGEST_WAIT_S))
        if self._run is not None:
            self._run.wait()

    def request_stop(self) -> None:
        """Ends `wait`. May be called from a signal handler and from other threads, and again."""
        self._is_unwanted = True
        if self._run is not None:
            self._run.request_stop()

    def stop(self) -> None:
        """Ends the nodes and tells the parent. Harmless when nothing was started."""
        if self._run is not None:
            self._run.stop()
        if self._server is not None:
            self._server.stop()
        self._link.close()
        self._console.close()

    def _carry_out(self, order: _Order) -> None:
        try:
            launch = load([], texts=[order.xml], surroundings=Surroundings.here(self._index))
        except LaunchError as error:
            self._is_ordered = False
            order.answer.set_result([-1, f"ERROR: {error}", [[], []]])
            return
        self._console.say("launching nodes...")
        self._console.say(f"ROS_MASTER_URI={self._environment.master_uri}")
        # Noetic's nodes are told the launcher's log file, too.
        variables = {**os.environ, "ROS_LOG_FILENAME": str(self._log)}
        run = Run(
            launch,
            CommandMaker(self._index, variables, self._environment.ros_home.expanduser().absolute()),
            master_uri=self._environment.master_uri,
            logs=self._logs,
            console=self._console,
            options=self._options,
            on_end=self._link.process_died,
        )
        self._run = run
        if self._is_unwanted:
            run.request_stop()
        try:
            failed = run.start_nodes()
        except LaunchError as error:
            order.answer.set_result([0, f"ERROR: {error}", [[], []]])
            return
        self._console.say("... done launching nodes")
        order.answer.set_result([1, "launched", [[process.name for process in run.processes()], failed]])

    def _processes(self) -> Sequence[ProcessReport]:
        return self._run.processes() if self._run is not None else ()

    async def _answer_launch(self, xml: str) -> list[Any]:
        if self._is_ordered:
            return [-1, "ERROR: this roslaunch child has launched its nodes already", [[], []]]
        self._is_ordered = True
        order = _Order(xml, Future())
        self._orders.put(order)
        return await asyncio.wrap_future(order.answer)

    def _answer_shutdown(self) -> list[Any]:
        self.request_stop()
        return [1, "success", 1]

    def _admits(self, peer: str) -> bool:
        """Whoever may call `launch` may run any program here; so nobody but the parent gets a connection."""
        return is_loopback(peer) or peer in self._employers


def _addresses_of_parent(uri: str) -> frozenset[str]:
    """The addresses from which the parent may call: those of its URI, and the one that it logged in from."""
    addresses = set()
    with suppress(OSError, ValueError):
        host, port, _ = split_uri(uri)
        addresses = {str(found[4][0]) for found in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)}
    logged_in_from = os.environ.get("SSH_CLIENT", "").split()
    return frozenset(map(plain_address, (*addresses, *logged_in_from[:1])))
