"""Executes a `Launch`: sets the parameters, starts the nodes, watches them, and stops them.

Theory of operation: signal handlers, the threads that wait for processes, and other threads put events
(process exited, stop requested) into one queue. The thread that calls `wait` or `watch_once` takes these
events and makes all decisions, such as restarting a node, giving up on it, or stopping everything. Other
threads may start and stop nodes in the meantime.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from queue import SimpleQueue

from pipros.basics.interruptible_wait import SLICE_S, get_within_slice
from pipros_tools.launch.command import CannotLaunch, CannotStart, CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.managed_node import AfterExit, ManagedNode, ProcessInfo
from pipros_tools.launch.model import Launch, LaunchError, LaunchNode, Output
from pipros_tools.launch.node_starter import NodeStarter
from pipros_tools.launch.nodelet_choice import with_choices
from pipros_tools.launch.param_upload import apply_parameters
from pipros_tools.launch.placement import Placement
from pipros_tools.launch.process import NodeProcess
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.terminate import await_exits, end, report_end

_CHECK_EVERY_S = 0.2


class _StopRequest:
    """A queued request to stop."""


class LaunchRun:
    """A running launch, watched by one thread.

    `start`, `end_one`, `stop_node`, `restart_node` and `request_stop` may be called from any thread.

    >>> run = LaunchRun(launch, maker, master_uri=uri, logs=logs, console=console)    # doctest: +SKIP
    >>> run.set_parameters()                                                    # doctest: +SKIP
    >>> run.start_nodes()                                                       # doctest: +SKIP
    >>> run.wait()                                                              # doctest: +SKIP
    >>> run.stop()                                                              # doctest: +SKIP
    """

    def __init__(
        self,
        launch: Launch,
        maker: CommandMaker,
        *,
        master_uri: str,
        logs: LogFolder,
        console: Console,
        options: RunOptions | None = None,
        placement: Placement | None = None,
        numbers: Iterator[int] | None = None,
        on_end: Callable[[str, int], None] | None = None,
    ) -> None:
        """Store the arguments. Nothing is started until `start_nodes` or `start` is called.

        Args:
            placement: the mapping of nodes to machines, if it has already been looked up.
            numbers: the numbers at the end of process names; by default, 1, 2, 3, …
            on_end: called with the name and exit code of each process after its exit has been reported.
        """
        self._launch, self._nodelet_lines = with_choices(launch)
        self._master_uri = master_uri
        self._logs = logs
        self._console = console
        self._options = options or RunOptions()
        self._on_end = on_end
        self._managed: list[ManagedNode] = []
        self._placement = placement or Placement(launch.machines)
        self._lock = threading.RLock()
        self._events: SimpleQueue[NodeProcess | _StopRequest] = SimpleQueue()
        self._starter = NodeStarter(
            maker,
            master_uri,
            self._launch.params,
            logs=logs,
            console=console,
            options=self._options,
            placement=self._placement,
            numbers=numbers or itertools.count(1),
            on_exit=self._events.put,
        )
        self._stop_requests = 0
        self._handled_requests = 0
        self._has_lost_required = False

    def set_parameters(self) -> None:
        """Run the dumps and deletions, then set the parameters. Call this before starting any node.

        Raises:
            Unreachable, LaunchError: the parameter server does not answer or refuses a value, or a dump
                cannot be written.
        """
        apply_parameters(self._launch, self._master_uri)

    def start_nodes(self) -> dict[str, str]:
        """Start all nodes in file order; return the names of those that cannot be launched, with the reasons.

        A node cannot be launched if, for example, its program is not found.

        Raises:
            LaunchError: a program exists but cannot be started; nodes that were started earlier keep running.
        """
        for line in self._nodelet_lines:
            self._console.say(line)
        failed = {}
        for node in self._launch.nodes:
            if self._stop_requests:
                break
            if self._options.local_only and self._placement.remote_machine(node) is not None:
                continue
            try:
                self.start(node)
            except CannotStart as error:
                raise LaunchError(str(error)) from None
            except CannotLaunch as error:
                self._console.error(f"ERROR: {error}")
                failed[node.name] = str(error)
        return failed

    def start(
        self, node: LaunchNode, extra_arguments: Sequence[str] = (), output: Output | None = None
    ) -> NodeProcess:
        """Start one node.

        Args:
            extra_arguments: words appended to the node's arguments.
            output: the destination for the node's standard output; by default, the destination in the
                options or, failing that, in the node.

        Raises:
            CannotLaunch: the program does not exist, or cannot be started.
        """
        process = self.start_managed(node, extra_arguments, output).latest
        assert process is not None  # noqa: S101  # just started
        return process

    def start_managed(
        self, node: LaunchNode, extra_arguments: Sequence[str] = (), output: Output | None = None
    ) -> ManagedNode:
        """Like `start`, but return an object that tracks the node's restarts and must not be modified."""
        with self._lock:
            managed = self._starter.prepare(node, extra_arguments, output)
            self._starter.start(managed)
            self._managed.append(managed)
            return managed

    def wait(self, *, until_all_ended: bool = True) -> None:
        """Watch the nodes, and restart nodes with `respawn`, until the launch stops.

        Return when a stop is requested, a required node exits or, if `until_all_ended` is set, all nodes have
        exited.
        """
        while self._is_running:
            if until_all_ended and not self.has_running:
                if self._managed:
                    self._console.say("all processes on machine have died, roslaunch will exit")
                else:
                    self._console.bold("No processes to monitor")
                return
            self._handle(self._next_event(None))

    def watch(self, process: NodeProcess, timeout_s: float | None = None) -> bool:
        """Like `wait`, but return once `process` has exited and its exit has been reported.

        Return False on timeout, or if the launch must stop.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while any(managed.process is process for managed in self._managed):
            left_s = None if deadline is None else deadline - time.monotonic()
            if not self._is_running or (left_s is not None and left_s <= 0):
                return False
            self._handle(self._next_event(left_s))
        return True

    def watch_once(self, timeout_s: float | None = None) -> bool:
        """Wait briefly for an event, and handle it. Return False if the launch must stop.

        Blocks up to `timeout_s`, but always less than a second.
        """
        if self._is_running:
            self._handle(self._next_event(timeout_s))
        return self._is_running

    def end_one(self, process: NodeProcess) -> None:
        """Stop one process, with the same signals and timeouts as `stop`. Return when it has exited.

        The watching thread handles this like any other exit, so a node with `respawn` is restarted, as in
        Noetic.
        """
        end(
            [process],
            self._console,
            await_exits,
            sigint_timeout_s=self._options.sigint_timeout_s,
            sigterm_timeout_s=self._options.sigterm_timeout_s,
            is_announced=False,
        )

    def stop_node(self, name: str) -> None:
        """Begin to stop the node whose process has this name, and do not restart it. Return immediately.

        Even if the node is required, the launch continues.

        Raises:
            LaunchError: the launch has no process with this name, or is ending.
        """
        self._end_node(name, AfterExit.STAY_STOPPED)

    def restart_node(self, name: str) -> None:
        """Begin to restart a node. If it is running, stop it first, like `stop_node`. Return immediately.

        Raises:
            LaunchError: the launch has no process with this name, or is ending.
        """
        self._end_node(name, AfterExit.START_AGAIN)

    @property
    def has_running(self) -> bool:
        """Whether the launch must continue.

        True if a node is running, is waiting to be restarted, has left child processes running, or was
        stopped by a user, who may start it again.
        """
        return not all(managed.is_done for managed in self._managed)

    def request_stop(self) -> None:
        """Make `wait` return.

        While `stop` is running, each further request immediately escalates to the next signal.

        May be called from a signal handler.
        """
        self._stop_requests += 1
        self._events.put(_StopRequest())

    def stop(self) -> None:
        """Stop all nodes with SIGINT, then SIGTERM, then SIGKILL, with a timeout between the steps.

        Return when all have exited, or when even SIGKILL had no effect.
        """
        self._handled_requests = self._stop_requests
        processes = []
        for managed in reversed(self._managed):
            managed.restart_at = None
            managed.is_stopped = False
            if not managed.is_done:
                processes += [item for item in (managed.process, managed.left_behind) if item is not None]
        end(
            processes,
            self._console,
            self._await,
            sigint_timeout_s=self._options.sigint_timeout_s,
            sigterm_timeout_s=self._options.sigterm_timeout_s,
        )
        for managed in self._managed:
            managed.process = managed.left_behind = None
        self._starter.close()

    def running(self) -> dict[str, int]:
        """Return the names and process ids of the running processes."""
        return {m.name: m.process.pid for m in self._managed if m.process and m.process.exit_code is None}

    def processes(self) -> list[ProcessInfo]:
        """Return a snapshot of the latest process of each node, in the order in which the nodes were started.

        May be called from any thread.
        """
        return [managed.info() for managed in list(self._managed)]

    def managed(self) -> list[ManagedNode]:
        """Return all nodes in the order in which they were started.

        They must not be modified. May be called from any thread.
        """
        return list(self._managed)

    def log_stem(self, name: str) -> str:
        """Return the common path of a process's log files, without their suffixes."""
        return self._logs.stem(name)

    def _end_node(self, name: str, after_exit: AfterExit) -> None:
        with self._lock:
            managed = next((item for item in self._managed if item.name == name), None)
            if managed is None:
                raise LaunchError(f"there is no node [{name}] in this launch")
            if not self._is_running:
                raise LaunchError("this launch is ending")
            if managed.process is not None:
                if managed.after_exit is AfterExit.AS_DECLARED:
                    self._end_in_background(managed.process)
                # If the node is already being stopped, send no second SIGINT: many nodes would then exit
                # without cleaning up.
                managed.after_exit = after_exit
            elif after_exit is AfterExit.START_AGAIN:
                if managed.left_behind is not None:
                    self._end_in_background(managed.left_behind)
                self._note_request(managed, after_exit)
            elif managed.restart_at is not None:
                self._note_request(managed, after_exit)

    def _end_in_background(self, process: NodeProcess) -> None:
        thread = threading.Thread(
            target=self.end_one, args=(process,), name=f"end {process.name}", daemon=True
        )
        try:
            thread.start()
        except RuntimeError as error:
            raise LaunchError(f"cannot stop [{process.name}]: {error}") from None

    def _note_request(self, managed: ManagedNode, after_exit: AfterExit) -> None:
        """Record what a user requested for a node that is not running.

        If a start was requested, the watching thread starts the node once all processes that the node left
        behind have exited.
        """
        managed.is_stopped = after_exit is AfterExit.STAY_STOPPED
        managed.restart_at = None if managed.is_stopped else time.monotonic()

    @property
    def _is_running(self) -> bool:
        return not self._stop_requests and not self._has_lost_required

    def _next_event(self, timeout_s: float | None) -> NodeProcess | _StopRequest | None:
        """Return the next event; None on timeout, or when a restart or a check for ended processes is due."""
        now = time.monotonic()
        due = [SLICE_S if timeout_s is None else timeout_s]
        due += [
            managed.restart_at - now
            for managed in self._managed
            if managed.restart_at is not None and managed.left_behind is None
        ]
        # The exit of a process that is not a child of this process can only be detected by polling.
        due += [_CHECK_EVERY_S for managed in self._managed if managed.left_behind is not None]
        return get_within_slice(self._events, min(due))

    def _handle(self, event: NodeProcess | _StopRequest | None) -> None:
        with self._lock:
            if isinstance(event, NodeProcess):
                managed = next((item for item in self._managed if item.process is event), None)
                if managed is not None:
                    self._handle_end(managed, event)
            self._restart_those_due()

    def _handle_end(self, managed: ManagedNode, process: NodeProcess) -> None:
        """Report that a process has exited, and decide what happens next."""
        requested, managed.after_exit = managed.after_exit, AfterExit.AS_DECLARED
        is_requested = requested is not AfterExit.AS_DECLARED
        is_required = (managed.node.required or self._options.all_required) and not is_requested
        report_end(process, self._logs.stem(process.name), self._console, is_required=is_required)
        managed.process = None
        if self._on_end is not None:
            self._on_end(process.name, process.exit_code or 0)
        if process.has_group:
            managed.left_behind = process
        if is_requested:
            self._note_request(managed, requested)
        elif is_required:
            self._has_lost_required = True
        elif managed.node.respawn:
            process.release()
            managed.left_behind = None
            managed.restart_at = time.monotonic() + max(0.0, managed.node.respawn_delay_s)

    def _restart_those_due(self) -> None:
        for managed in self._managed:
            if managed.restart_at is None or managed.restart_at > time.monotonic() or not self._is_running:
                continue
            if managed.left_behind is not None and managed.left_behind.has_group:
                continue
            managed.left_behind = None
            self._console.say(f"[{managed.name}] restarting process")
            try:
                self._starter.start(managed)
            except CannotLaunch as error:
                managed.restart_at = None
                self._console.error(f"ERROR: {error}")

    def _await(self, processes: Sequence[NodeProcess], timeout_s: float) -> list[NodeProcess]:
        """Wait for processes to exit. Return those still running.

        Return when all have exited, on timeout, or when another stop is requested.
        """
        deadline = time.monotonic() + timeout_s
        left = [process for process in processes if process.exit_code is None]
        while left and time.monotonic() < deadline and self._stop_requests <= self._handled_requests:
            get_within_slice(self._events, deadline - time.monotonic())
            left = [process for process in left if process.exit_code is None]
        self._handled_requests = min(self._handled_requests + 1, self._stop_requests)
        return left
