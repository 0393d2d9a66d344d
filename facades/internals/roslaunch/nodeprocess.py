"""Processes on this computer, created by scripts or for the nodes of a launch."""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.interruptible_wait import wait_in_slices
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.command import CannotLaunch, CommandMaker, NodeCommand
from pipros.launch.console import Console
from pipros.launch.guardian import Guardian
from pipros.launch.logs import LogFolder
from pipros.launch.managed_node import ManagedNode
from pipros.launch.process import NodeProcess
from pipros.launch.run import LaunchRun
from pipros.launch.terminate import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S, end
from pipros.workspace.index import PackageIndex
from roslaunch.core import (
    HANDED_ON,
    Master,
    Node,
    RLException,
    printlog_bold,
)
from roslaunch.node_args import create_local_process_args
from roslaunch.pmon import FatalProcessLaunch, Process

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "NUM_WORKERS",
    "FatalProcessLaunch",
    "LocalProcess",
    "Process",
    "create_local_process_args",
    "create_master_process",
    "create_node_process",
]

_star_names(
    __name__,
    f"{HANDED_ON} "
    "basestring=builtins:str errno xml.sax.saxutils:escape logging xmlrpc.client:MultiCall os re rosgraph "
    "rospkg xmlrpc.client:ServerProxy signal socket subprocess sys time traceback unicode=builtins:str",
)

DEFAULT_TIMEOUT_SIGINT = SIGINT_TIMEOUT_S
DEFAULT_TIMEOUT_SIGTERM = SIGTERM_TIMEOUT_S
NUM_WORKERS = 3

process_numbers = itertools.count(1)
"""Numbers of the launched processes. They are unique across all launches, and part of the log file names."""


class LocalProcess(Process):
    """A program on this computer, in its own process group.

    Attributes:
        log_output: whether the program's output is written to the run's log files instead of the terminal.
        cwd: "node" for the program's folder; defaults to ROS_HOME.
    """

    def __init__(
        self,
        run_id: str,
        package: str,
        name: str,
        args: Sequence[str],
        env: Mapping[str, str],
        log_output: bool,
        respawn: bool = False,
        respawn_delay: float = 0.0,
        required: bool = False,
        cwd: str | None = None,
        is_node: bool = True,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        super().__init__(package, name, args, env, respawn, respawn_delay, required)
        self.run_id = run_id
        self.log_output = log_output
        self.started = False
        self.stopped = False
        self.cwd = cwd
        self.log_dir: str | None = None
        self.pid = -1
        self.is_node = is_node
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        self.popen: Any = None
        self._process: NodeProcess | None = None
        self._guardian = Guardian()

    def get_info(self) -> dict[str, Any]:
        info = {**super().get_info(), "run_id": self.run_id, "log_output": self.log_output}
        return {**info, "pid": self.pid} if self.pid > 0 else info

    def start(self) -> bool:
        """Start the program and return True.

        Raises:
            FatalProcessLaunch: the operating system cannot start the program.
        """
        super().start()
        environment = Environment.from_os()
        logs = LogFolder.of_run(environment, self.run_id)
        logs.check_writable()
        stem = logs.stem(self.name)
        words = [*self.args, *([f"__log:={stem}.log"] if self.is_node else [])]
        folder = Path(self.args[0]).parent if self.cwd == "node" else environment.ros_home
        self._guardian.start()
        try:
            process = NodeProcess(
                self.name,
                NodeCommand(tuple(words), {**os.environ, **self.env}, self.env, folder),
                stdout_log=Path(f"{stem}-stdout.log") if self.log_output else None,
                guardian=self._guardian,
                on_exit=lambda _: None,
                restarts=self.spawn_count > 1,
            )
        except CannotLaunch as error:
            raise FatalProcessLaunch(str(error)) from error
        self.log_dir = str(logs.path)
        self._process, self.pid, self.popen = process, process.pid, process.popen
        self.started, self.stopped, self.exit_code = True, False, None
        printlog_bold(f"process[{self.name}]: started with pid [{self.pid}]")
        return True

    def is_alive(self) -> bool:
        process = self._process
        if process is None:
            return super().is_alive() if self.started else True
        if process.exit_code is None and not self.stopped:
            return True
        if process.exit_code is not None:
            self.exit_code = process.exit_code
        return super().is_alive()

    def stop(self, errors: list[str] | None = None) -> None:
        """Stop the program and its children with SIGINT, then SIGTERM, then SIGKILL.

        Blocks until the program has exited.
        """
        process = self._process
        if process is None or self.stopped:
            return
        end(
            [process],
            Console(has_title=False),
            _await_ends,
            sigint_timeout_s=self.sigint_timeout,
            sigterm_timeout_s=self.sigterm_timeout,
            is_announced=False,
        )
        if process.exit_code is None and errors is not None:
            errors.append(f"process[{self.name}, pid {self.pid}]: required SIGKILL.")
        self.exit_code = process.exit_code
        self.stopped = True
        self._guardian.stop()

    def get_exit_description(self) -> str:
        logs = f"log file: {LogFolder.of_run(Environment.from_os(), self.run_id).stem(self.name)}*.log"
        command = " ".join(self.args)
        if self.exit_code is None:
            return f"process has died without exit code [pid {self.pid}, cmd {command}].\n{logs}"
        if self.exit_code:
            what = f"process has died [pid {self.pid}, exit code {self.exit_code}, cmd {command}]."
            return f"{what}\n{logs}"
        return f"process has finished cleanly\n{logs}"


class RunProcess(LocalProcess):
    """A node in a launch. As in Noetic, the object stays the same when the node is restarted."""

    def __init__(self, run: LaunchRun, run_id: str, managed: ManagedNode) -> None:
        self._run = run
        self._managed = managed
        node = managed.node
        super().__init__(
            run_id,
            node.package,
            managed.name,
            list(managed.command.argv),
            dict(managed.command.overlay),
            managed.info().has_log,
            node.respawn,
            node.respawn_delay_s,
            node.required,
            cwd=node.working_folder.value if node.working_folder else None,
        )
        self.started = True
        self.full_name = node.full_name

    # State of the latest process. Noetic's classes assign to these attributes; the assignments are ignored.

    @property
    def pid(self) -> int:
        return self._managed.info().pid

    @pid.setter
    def pid(self, value: int) -> None:
        """Do nothing."""

    @property
    def popen(self) -> Any:
        return None if self._managed.latest is None else self._managed.latest.popen

    @popen.setter
    def popen(self, value: object) -> None:
        """Do nothing."""

    @property
    def exit_code(self) -> int | None:
        return self._managed.info().exit_code

    @exit_code.setter
    def exit_code(self, value: int | None) -> None:
        """Do nothing."""

    @property
    def spawn_count(self) -> int:
        return self._managed.info().spawn_count

    @spawn_count.setter
    def spawn_count(self, value: int) -> None:
        """Do nothing."""

    @property
    def is_watched(self) -> bool:
        """Whether the node is running or waiting to be restarted."""
        return not self._managed.is_done

    def start(self) -> bool:
        """Return True, for compatibility. The launch itself starts its nodes."""
        return True

    def is_alive(self) -> bool:
        return self.exit_code is None or Process.is_alive(self)

    def stop(self, errors: list[str] | None = None) -> None:
        _ = errors
        process = self._managed.latest
        if process is not None:
            self._run.end_one(process)


class RunProcesses:
    """The nodes of a launch, with the interface that `ProcessMonitor` requires."""

    def __init__(self, run: LaunchRun, run_id: str, stop: Callable[[], None]) -> None:
        """Store the arguments. `stop` is the function that stops all nodes."""
        self._run = run
        self._run_id = run_id
        self._stop = stop
        self._known: dict[str, RunProcess] = {}
        self._lock = threading.Lock()

    def watch_once(self, timeout_s: float | None = None) -> bool:
        return self._run.watch_once(timeout_s)

    def stop(self) -> None:
        self._stop()

    def of(self, managed: ManagedNode) -> RunProcess:
        """Return a node's process, which is always the same object."""
        with self._lock:
            if managed.name not in self._known:
                self._known[managed.name] = RunProcess(self._run, self._run_id, managed)
            return self._known[managed.name]

    def alive(self) -> list[RunProcess]:
        """Return the processes that are running or waiting to be restarted."""
        return [process for process in self.all() if process.is_watched]

    def ended(self) -> list[RunProcess]:
        """Return the processes that have exited permanently."""
        return [process for process in self.all() if not process.is_watched]

    def all(self) -> list[RunProcess]:
        """Return all processes, running or exited, in start order."""
        return [self.of(managed) for managed in self._run.managed()]


def _await_ends(processes: Sequence[NodeProcess], timeout_s: float) -> list[NodeProcess]:
    deadline = time.monotonic() + timeout_s
    return [process for process in processes if not wait_in_slices(process.wait, deadline - time.monotonic())]


def create_node_process(
    run_id: str,
    node: Node,
    master_uri: str,
    sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
    sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
) -> LocalProcess:
    """Create the process of a node on this computer. The caller registers it with a monitor and starts it.

    Raises:
        ValueError: the node has no name, or a name with a slash.
        NodeParamsException: the node's program does not exist.
    """
    if not node.name:
        raise ValueError("node name must be defined")
    maker = CommandMaker.for_launcher(Environment.from_os(), PackageIndex.from_environment())
    try:
        command = maker.make(node.to_model(), master_uri)
    except CannotLaunch as error:
        from roslaunch.node_args import NodeParamsException

        raise NodeParamsException(error.reason) from error
    name = f"{(node.namespace + node.name).lstrip('/')}-{next(process_numbers)}"
    return LocalProcess(
        run_id,
        node.package,
        name,
        list(command.argv),
        dict(command.environment),
        node.output != "screen",
        respawn=node.respawn,
        respawn_delay=node.respawn_delay,
        required=node.required,
        cwd=node.cwd,
        sigint_timeout=sigint_timeout,
        sigterm_timeout=sigterm_timeout,
    )


def create_master_process(
    run_id: str,
    type_: str,
    ros_root: str | None,
    port: int,
    num_workers: int = NUM_WORKERS,
    timeout: float | None = None,
    master_logger_level: object = False,
    sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
    sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
) -> LocalProcess:
    """Create the process of a new master. The caller registers it with a monitor and starts it.

    Raises:
        RLException: the port is not positive, or the master type is unknown.
    """
    _ = ros_root
    if port < 1:
        raise RLException(f"invalid port assignment: {port}")
    if type_ not in (Master.ROSMASTER, Master.ZENMASTER):
        raise RLException(f"unknown master typ_: {type_}")
    words = [type_, "--core", "-p", str(port), "-w", str(num_workers)]
    if timeout is not None:
        words += ["-t", str(timeout)]
    if master_logger_level:
        words += ["--master-logger-level", str(master_logger_level)]
    words[0] = _program("rosmaster")
    return LocalProcess(
        run_id,
        "rosmaster",
        "master",
        words,
        os.environ,
        False,
        sigint_timeout=sigint_timeout,
        sigterm_timeout=sigterm_timeout,
    )


def _program(name: str) -> str:
    """Return the path of a command in this Python's folder, or just the name if it is not there.

    The folder may be missing from PATH.
    """
    import sys

    beside = Path(sys.executable).with_name(name)
    return str(beside) if beside.exists() else name
