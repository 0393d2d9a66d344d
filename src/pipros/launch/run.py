"""Carries out a `Launch`: sets the parameters, starts the nodes, watches them, and ends them.

Ends of processes come from threads that wait for them, and wishes to stop from signal handlers and other
threads; both go through one queue to the thread that calls `wait`. All decisions (restart, give up, end
everything) are made there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from pipros.launch.command import CannotLaunch, CannotStart, CommandMaker
from pipros.launch.console import Console
from pipros.launch.ending import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S, end, report_end
from pipros.launch.guardian import Guardian
from pipros.launch.logs import LogFolder
from pipros.launch.managed import ManagedNode
from pipros.launch.model import Launch, LaunchError, Machine, Node, Output
from pipros.launch.process import NodeProcess
from pipros.launch.report import ProcessReport
from pipros.launch.upload import apply_parameters
from pipros.launch.whereabouts import is_here

_LOOK_EVERY_S = 0.2

# A signal that comes in the moment in which the main thread begins to wait for a lock is noticed when
# that wait ends, and not before; so no wait is long, and no Ctrl-C is lost.
_LONGEST_WAIT_S = 0.2


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run, as the command line has it.

    Attributes:
        output: where the standard output of all nodes goes; None leaves it to each node.
        all_required: whether the end of any node ends all.
        local_only: whether nodes on other machines are left out.
        has_labels: whether lines of nodes on the terminal bear their names.
        is_child: whether this launcher is the far side of another one, and nobody sees its standard output.
    """

    output: Output | None = None
    all_required: bool = False
    local_only: bool = False
    has_labels: bool = False
    is_child: bool = False
    sigint_timeout_s: float = SIGINT_TIMEOUT_S
    sigterm_timeout_s: float = SIGTERM_TIMEOUT_S

    def __post_init__(self) -> None:
        for name, value in (
            ("sigint_timeout", self.sigint_timeout_s),
            ("sigterm_timeout", self.sigterm_timeout_s),
        ):
            if not value > 0:
                raise LaunchError(f"{name} must be a positive number, received {value:f}")


class _Stop:
    """A wish to stop, in the queue among the processes that ended."""


class Run:
    """One launch being carried out. Use it from one thread; `request_stop` may be called from anywhere.

    >>> run = Run(launch, maker, master_uri=uri, logs=logs, console=console)    # doctest: +SKIP
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
        first_number: int = 1,
        on_end: Callable[[str, int], None] | None = None,
    ) -> None:
        """Nothing is started yet.

        Args:
            first_number: the number of the first process; Noetic counts `/rosout` as the first one.
            on_end: called with the name and the exit code of each process that ended, after it was reported.
        """
        self._launch = launch
        self._maker = maker
        self._master_uri = master_uri
        self._logs = logs
        self._console = console
        self._options = options or RunOptions()
        self._number = first_number
        self._on_end = on_end
        self._guardian = Guardian(maker.mark)
        self._managed: list[ManagedNode] = []
        self._is_here: dict[str, bool] = {}
        self._events: SimpleQueue[NodeProcess | _Stop] = SimpleQueue()
        self._stop_requests = 0
        self._answered_requests = 0
        self._lost_required = False

    def set_parameters(self) -> None:
        """Dumps, deletes and sets parameters, in this order, before any node is started.

        Raises:
            Unreachable, Refused, LaunchError: the parameter server cannot or will not.
        """
        apply_parameters(self._launch, self._master_uri)

    def start_nodes(self) -> list[str]:
        """Starts all nodes in the order of the file. Returns the names of those that have no program.

        Raises:
            LaunchError: a program is there and cannot be started; those before it run.
        """
        failed = []
        for node in self._launch.nodes:
            if self._stop_requests:
                break
            if not self._is_here_or_wanted(node):
                continue
            try:
                self.start(node)
            except CannotStart as error:
                raise LaunchError(str(error)) from None
            except CannotLaunch as error:
                self._console.error(f"ERROR: {error}")
                failed.append(node.name)
        return failed

    def start(
        self, node: Node, extra_arguments: Sequence[str] = (), output: Output | None = None
    ) -> NodeProcess:
        """Starts one node.

        Args:
            extra_arguments: what its command line has after its own arguments.
            output: where its standard output goes, whatever the node and the options say.

        Raises:
            CannotLaunch: there is no such program, or it cannot be started.
        """
        self._guardian.start()
        number = self._number
        self._number += 1
        name = f"{node.full_name.lstrip('/')}-{number}"
        command = self._maker.make(
            node,
            self._master_uri,
            log_stem=self._logs.stem(name),
            machine=self._machine(node),
            extra_arguments=extra_arguments,
        )
        output = output or self._options.output or node.output
        managed = ManagedNode(name, node, command, output, number)
        self._start(managed)
        self._managed.append(managed)
        assert managed.process is not None  # noqa: S101  # just set
        return managed.process

    def wait(self, *, until_all_ended: bool = True) -> None:
        """Watches the nodes, and restarts those that want it, until it is time to stop.

        That is when a stop is requested, when a required node ended, or, if wanted, when all ended.
        """
        while self._is_wanted:
            if until_all_ended and not self.has_running:
                if self._managed:
                    self._console.say("all processes on machine have died, roslaunch will exit")
                else:
                    self._console.bold("No processes to monitor")
                return
            self._handle(self._next_event(None))

    def watch(self, process: NodeProcess, timeout_s: float | None = None) -> bool:
        """As `wait`, but until this one process ended and its end was reported.

        False when the time was over first, and when it is time to stop.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while any(managed.process is process for managed in self._managed):
            left_s = None if deadline is None else deadline - time.monotonic()
            if not self._is_wanted or (left_s is not None and left_s <= 0):
                return False
            self._handle(self._next_event(left_s))
        return True

    def poll(self) -> bool:
        """Handles what has happened since the last look, without waiting. False when it is time to stop."""
        while not self._events.empty():
            self._handle(self._events.get())
        self._restart_those_due()
        return self._is_wanted

    def end_one(self, process: NodeProcess) -> None:
        """Ends one process, as `stop` ends all; it is not started again."""
        for managed in self._managed:
            if managed.process is process:
                managed.process = None
                managed.restart_at = None
        end(
            [process],
            self._console,
            self._await,
            sigint_timeout_s=self._options.sigint_timeout_s,
            sigterm_timeout_s=self._options.sigterm_timeout_s,
        )

    @property
    def has_running(self) -> bool:
        """Whether anything is running, or waits to be started again."""
        return not all(managed.is_done for managed in self._managed)

    def request_stop(self) -> None:
        """Ends `wait`. While `stop` runs, each further request goes on to the next, harder signal at once.

        May be called from a signal handler.
        """
        self._stop_requests += 1
        self._events.put(_Stop())

    def stop(self) -> None:
        """Ends all nodes: SIGINT, SIGTERM after a while, SIGKILL after another. Returns when all are gone."""
        self._answered_requests = self._stop_requests
        processes = []
        for managed in reversed(self._managed):
            managed.restart_at = None
            if not managed.is_done:
                processes += [one for one in (managed.process, managed.left_behind) if one is not None]
        end(
            processes,
            self._console,
            self._await,
            sigint_timeout_s=self._options.sigint_timeout_s,
            sigterm_timeout_s=self._options.sigterm_timeout_s,
        )
        self._guardian.stop()

    def running(self) -> dict[str, int]:
        """The names and process numbers of what runs at the moment."""
        return {m.name: m.process.pid for m in self._managed if m.process and m.process.exit_code is None}

    def processes(self) -> list[ProcessReport]:
        """What was started so far, in that order, and what became of it. May be called from any thread."""
        return [managed.report() for managed in list(self._managed)]

    def _machine(self, node: Node) -> Machine | None:
        machine = self._launch.machines.get(node.machine)
        if machine is None:
            return None
        if machine.name not in self._is_here:  # names are looked up once, not for each node
            self._is_here[machine.name] = is_here(machine)
        return None if self._is_here[machine.name] else machine

    def _is_here_or_wanted(self, node: Node) -> bool:
        return not self._options.local_only or self._machine(node) is None

    def _start(self, managed: ManagedNode) -> None:
        stem, is_logged = self._logs.stem(managed.name), managed.output is Output.LOG
        is_again = managed.restart_at is not None
        managed.restart_at = None
        managed.process = managed.latest = NodeProcess(
            managed.name,
            managed.command,
            stdout_log=Path(f"{stem}-stdout.log") if is_logged or self._options.is_child else None,
            stderr_log=Path(f"{stem}-stderr.log") if is_logged and self._options.is_child else None,
            guardian=self._guardian,
            on_exit=self._events.put,
            restarts=is_again,
            label=managed.number if self._options.has_labels else None,
        )
        managed.spawn_count += 1
        self._console.bold(f"process[{managed.name}]: started with pid [{managed.process.pid}]")

    @property
    def _is_wanted(self) -> bool:
        return not self._stop_requests and not self._lost_required

    def _next_event(self, timeout_s: float | None) -> NodeProcess | _Stop | None:
        """The next event; None when the time is over, a restart is due, or it is time to look around."""
        now = time.monotonic()
        due = [_LONGEST_WAIT_S]
        due += [managed.restart_at - now for managed in self._managed if managed.restart_at is not None]
        # Nobody tells about the end of a process that is not a child of ours.
        due += [_LOOK_EVERY_S for managed in self._managed if managed.left_behind is not None]
        due += [] if timeout_s is None else [timeout_s]
        with suppress(Empty):
            return self._events.get(timeout=max(0.0, min(due)))
        return None

    def _handle(self, event: NodeProcess | _Stop | None) -> None:
        if isinstance(event, NodeProcess):
            managed = next((one for one in self._managed if one.process is event), None)
            if managed is not None:
                self._handle_end(managed, event)
        self._restart_those_due()

    def _handle_end(self, managed: ManagedNode, process: NodeProcess) -> None:
        """Reports the end of a process and decides what follows."""
        is_required = managed.node.required or self._options.all_required
        report_end(process, self._logs.stem(process.name), self._console, is_required=is_required)
        managed.process = None
        if self._on_end is not None:
            self._on_end(process.name, process.exit_code or 0)
        if process.has_group:
            managed.left_behind = process
        if is_required:
            self._lost_required = True
        elif managed.node.respawn:
            process.release()
            managed.left_behind = None
            managed.restart_at = time.monotonic() + max(0.0, managed.node.respawn_delay_s)

    def _restart_those_due(self) -> None:
        for managed in self._managed:
            if managed.restart_at is None or managed.restart_at > time.monotonic() or not self._is_wanted:
                continue
            self._console.say(f"[{managed.name}] restarting process")
            try:
                self._start(managed)
            except CannotLaunch as error:
                managed.restart_at = None
                self._console.error(f"ERROR: {error}")

    def _await(self, processes: Sequence[NodeProcess], timeout_s: float) -> list[NodeProcess]:
        """Waits for the ends of processes; gives those that are left.

        It ends when all are gone, when the time is over, and when somebody asked once more to stop.
        """
        deadline = time.monotonic() + timeout_s
        left = [process for process in processes if process.exit_code is None]
        while left and time.monotonic() < deadline and self._stop_requests <= self._answered_requests:
            with suppress(Empty):
                self._events.get(timeout=max(0.0, min(_LONGEST_WAIT_S, deadline - time.monotonic())))
            left = [process for process in left if process.exit_code is None]
        self._answered_requests = min(self._answered_requests + 1, self._stop_requests)
        return left
