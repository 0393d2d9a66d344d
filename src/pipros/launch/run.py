"""Carries out a `Launch`: sets the parameters, starts the nodes, watches them, and ends them.

Ends of processes come from threads that wait for them, and wishes to stop from signal handlers and other
threads; both go through one queue to the thread that calls `wait`. All decisions (restart, give up, end
everything) are made there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from pipros.launch.command import CannotLaunch, Command, CommandMaker
from pipros.launch.console import Console
from pipros.launch.guardian import Guardian
from pipros.launch.logs import LogFolder
from pipros.launch.model import Launch, LaunchError, Machine, Node, Output
from pipros.launch.process import SIGINT, SIGKILL, SIGTERM, NodeProcess, last_lines
from pipros.launch.upload import apply_parameters

SIGINT_TIMEOUT_S = 15.0
SIGTERM_TIMEOUT_S = 2.0

_LOOK_EVERY_S = 0.2
_LEFT_BEHIND_TIMEOUT_S = 1.0

_LOCAL_ADDRESSES = frozenset(("localhost", "127.0.0.1", "::1", "0.0.0.0"))  # noqa: S104


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run, as the command line has it.

    Attributes:
        output: where the standard output of all nodes goes; None leaves it to each node.
        all_required: whether the end of any node ends all.
        local_only: whether nodes on other machines are left out.
    """

    output: Output | None = None
    all_required: bool = False
    local_only: bool = False
    sigint_timeout_s: float = SIGINT_TIMEOUT_S
    sigterm_timeout_s: float = SIGTERM_TIMEOUT_S

    def __post_init__(self) -> None:
        for name, value in (
            ("sigint_timeout", self.sigint_timeout_s),
            ("sigterm_timeout", self.sigterm_timeout_s),
        ):
            if not value > 0:
                raise LaunchError(f"{name} must be a positive number, received {value:f}")


@dataclass(slots=True)
class _Managed:
    """A node and what became of it.

    Attributes:
        process: its process of the moment; None between the end of one and the start of the next.
        left_behind: its ended process, as long as something that it started still runs.
        restart_at: when it is to be started again.
    """

    name: str
    node: Node
    command: Command
    process: NodeProcess | None = None
    left_behind: NodeProcess | None = None
    restart_at: float | None = None

    @property
    def is_done(self) -> bool:
        if self.left_behind is not None and not self.left_behind.has_group:
            self.left_behind = None
        return self.process is None and self.left_behind is None and self.restart_at is None


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
    ) -> None:
        """Nothing is started yet.

        Args:
            first_number: the number of the first process; Noetic counts `/rosout` as the first one.
        """
        self._launch = launch
        self._maker = maker
        self._master_uri = master_uri
        self._logs = logs
        self._console = console
        self._options = options or RunOptions()
        self._number = first_number
        self._guardian = Guardian()
        self._managed: list[_Managed] = []
        self._events: SimpleQueue[NodeProcess | _Stop] = SimpleQueue()
        self._stop_requests = 0

    def set_parameters(self) -> None:
        """Dumps, deletes and sets parameters, in this order, before any node is started.

        Raises:
            Unreachable, Refused, LaunchError: the parameter server cannot or will not.
        """
        apply_parameters(self._launch, self._master_uri)

    def start_nodes(self) -> list[str]:
        """Starts all nodes in the order of the file. Returns the names of those that could not be started."""
        failed = []
        for node in self._launch.nodes:
            if self._stop_requests:
                break
            if not self._is_here_or_wanted(node):
                continue
            try:
                self.start(node)
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
        name = f"{node.full_name.lstrip('/')}-{self._number}"
        self._number += 1
        command = self._maker.make(
            node,
            self._master_uri,
            log_stem=self._logs.stem(name),
            machine=self._machine(node),
            extra_arguments=extra_arguments,
        )
        managed = _Managed(name, node, command)
        self._start(managed, output or self._options.output or node.output)
        self._managed.append(managed)
        assert managed.process is not None  # noqa: S101  # just set
        return managed.process

    def wait(self, *, until_all_ended: bool = True) -> None:
        """Watches the nodes: restarts those that want it, and returns when nothing is left to watch.

        That is when a stop is requested, when a required node ends, or, if wanted, when all have ended.
        """
        while not self._stop_requests:
            if until_all_ended and all(managed.is_done for managed in self._managed):
                self._console.say("all processes on machine have died, roslaunch will exit")
                return
            event = self._next_event()
            if isinstance(event, NodeProcess) and not self._handle_end(event):
                return
            self._restart_those_due()

    def request_stop(self) -> None:
        """Ends `wait`. While `stop` runs, each further request goes on to the next, harder signal at once.

        May be called from a signal handler.
        """
        self._stop_requests += 1
        self._events.put(_Stop())

    def stop(self) -> None:
        """Ends all nodes: SIGINT, SIGTERM after a while, SIGKILL after another. Returns when all are gone."""
        asked = self._stop_requests
        running = [managed for managed in reversed(self._managed) if not managed.is_done]
        for managed in running:
            self._console.say(f"[{managed.name}] killing on exit")
            managed.restart_at = None
        started = (one for managed in running for one in (managed.process, managed.left_behind))
        processes = [process for process in started if process is not None]
        errors: list[str] = []
        for process in processes:
            process.send_signal(SIGINT)
        left = self._await(processes, self._options.sigint_timeout_s, asked)
        for number, timeout_s in ((SIGTERM, self._options.sigterm_timeout_s), (SIGKILL, 2.0)):
            if not left:
                break
            asked = max(asked, self._stop_requests)
            for process in left:
                self._console.error(f"[{process.name}] escalating to {number.name}")
                process.send_signal(number)
                if number is SIGKILL:
                    errors.append(f"process[{process.name}, pid {process.pid}]: required SIGKILL.")
            left = self._await(left, timeout_s, asked)
        self._end_left_behind(processes)
        self._guardian.stop()
        if errors:
            self._console.error("Shutdown errors:\n" + "\n".join(f" * {error}" for error in errors))

    def running(self) -> dict[str, int]:
        """The names and process numbers of what runs at the moment."""
        return {m.name: m.process.pid for m in self._managed if m.process and m.process.exit_code is None}

    def _machine(self, node: Node) -> Machine | None:
        machine = self._launch.machines.get(node.machine)
        return None if machine is None or machine.address in _LOCAL_ADDRESSES else machine

    def _is_here_or_wanted(self, node: Node) -> bool:
        return not self._options.local_only or self._machine(node) is None

    def _start(self, managed: _Managed, output: Output) -> None:
        stdout_log = None
        if output is Output.LOG:
            stdout_log = Path(self._logs.stem(managed.name) + "-stdout.log")
        is_again = managed.restart_at is not None
        managed.restart_at = None
        managed.process = NodeProcess(
            managed.name,
            managed.command,
            stdout_log=stdout_log,
            guardian=self._guardian,
            on_exit=self._events.put,
            restarts=is_again,
        )
        self._console.bold(f"process[{managed.name}]: started with pid [{managed.process.pid}]")

    def _next_event(self) -> NodeProcess | _Stop | None:
        """The next event; None when a restart is due first, or when it is time to look around."""
        now = time.monotonic()
        due = [managed.restart_at - now for managed in self._managed if managed.restart_at is not None]
        # Nobody tells about the end of a process that is not a child of ours.
        due += [_LOOK_EVERY_S for managed in self._managed if managed.left_behind is not None]
        with suppress(Empty):
            return self._events.get(timeout=max(0.0, min(due)) if due else None)
        return None

    def _handle_end(self, process: NodeProcess) -> bool:
        """Reports the end of a process and decides what follows. False when everything is to end."""
        managed = next((one for one in self._managed if one.process is process), None)
        if managed is None:
            return True
        text = self._description_of_end(process)
        if managed.node.required or self._options.all_required:
            rule = "=" * 80
            self._console.error(
                f"{rule}REQUIRED process [{process.name}] has died!\n{text}\nInitiating shutdown!\n{rule}"
            )
            return False
        if process.exit_code == 0:
            self._console.bold(f"[{process.name}] {text}")
        else:
            self._console.error(f"[{process.name}] {text}")
            self._show_last_lines(process)
        managed.process = None
        if managed.node.respawn:
            process.release()
            managed.restart_at = time.monotonic() + max(0.0, managed.node.respawn_delay_s)
        elif process.has_group:
            managed.left_behind = process
        return True

    def _description_of_end(self, process: NodeProcess) -> str:
        log = f"log file: {self._logs.stem(process.name)}*.log"
        if process.exit_code == 0:
            return f"process has finished cleanly\n{log}"
        command = " ".join(process.command.argv)
        return f"process has died [pid {process.pid}, exit code {process.exit_code}, cmd {command}].\n{log}"

    def _show_last_lines(self, process: NodeProcess) -> None:
        lines = last_lines(process.stdout_log) if process.stdout_log else []
        if lines:
            shown = "\n".join(f"[{process.name}]   {line}" for line in lines)
            self._console.error(f"[{process.name}] the last that it printed:\n{shown}")

    def _restart_those_due(self) -> None:
        for managed in self._managed:
            if managed.restart_at is None or managed.restart_at > time.monotonic() or self._stop_requests:
                continue
            self._console.say(f"[{managed.name}] restarting process")
            try:
                self._start(managed, self._options.output or managed.node.output)
            except CannotLaunch as error:
                managed.restart_at = None
                self._console.error(f"ERROR: {error}")

    def _await(self, processes: Sequence[NodeProcess], timeout_s: float, asked: int) -> list[NodeProcess]:
        """Waits for the ends of processes; gives those that are left.

        It ends when all are gone, when the time is over, and when somebody asked once more to stop.
        """
        deadline = time.monotonic() + timeout_s
        left = [process for process in processes if process.exit_code is None]
        while left and time.monotonic() < deadline and self._stop_requests <= asked:
            with suppress(Empty):
                self._events.get(timeout=max(0.0, deadline - time.monotonic()))
            left = [process for process in left if process.exit_code is None]
        return left

    def _end_left_behind(self, processes: Sequence[NodeProcess]) -> None:
        """Ends what ended processes started. SIGINT did not: shells make their background jobs ignore it."""
        left = [process for process in processes if process.has_group]
        for process in left:
            process.send_signal(SIGTERM)
        deadline = time.monotonic() + _LEFT_BEHIND_TIMEOUT_S
        while any(process.has_group for process in left) and time.monotonic() < deadline:
            time.sleep(_LOOK_EVERY_S / 20)
        for process in processes:
            process.release()
