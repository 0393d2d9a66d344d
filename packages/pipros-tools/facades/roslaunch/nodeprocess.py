"""The processes of a launch's nodes on this computer."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any

from pipros_tools.launch.managed_node import ManagedNode
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.terminate import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S
from roslaunch.core import *  # noqa: F403  # as in Noetic
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
]

DEFAULT_TIMEOUT_SIGINT = SIGINT_TIMEOUT_S
DEFAULT_TIMEOUT_SIGTERM = SIGTERM_TIMEOUT_S
NUM_WORKERS = 3

process_numbers = itertools.count(1)
"""Numbers of the launched processes. They are unique in this Python process, and part of log file names."""


class LocalProcess(Process):
    """The process of a node in a launch. As in Noetic, restarting the node does not create a new object.

    Attributes:
        log_output: whether the node's output is written to the run's log files instead of the terminal.
        cwd: "node" for the program's folder; defaults to ROS_HOME.
    """

    def __init__(self, run: LaunchRun, run_id: str, managed: ManagedNode) -> None:
        self._run = run
        self._managed = managed
        node = managed.node
        super().__init__(
            node.package,
            managed.name,
            list(managed.command.argv),
            dict(managed.command.overlay),
            node.respawn,
            node.respawn_delay_s,
            node.required,
        )
        self.run_id = run_id
        self.log_output = managed.info().has_log
        self.cwd = node.working_folder.value if node.working_folder else None
        self.full_name = node.full_name

    def get_info(self) -> dict[str, Any]:
        info = {**super().get_info(), "run_id": self.run_id, "log_output": self.log_output}
        return {**info, "pid": self.pid} if self.pid > 0 else info

    @property
    def pid(self) -> int:
        return self._managed.info().pid

    @property
    def popen(self) -> Any:
        return None if self._managed.latest is None else self._managed.latest.popen

    @property
    def exit_code(self) -> int | None:
        return self._managed.info().exit_code

    @property
    def spawn_count(self) -> int:
        return self._managed.info().spawn_count

    @property
    def is_watched(self) -> bool:
        """Whether the node is running, may be restarted (also by a user), or left child processes behind."""
        return not self._managed.is_done

    def is_alive(self) -> bool:
        return self.exit_code is None

    def stop(self, errors: list[str] | None = None) -> None:
        _ = errors
        process = self._managed.latest
        if process is not None:
            self._run.end_one(process)


class RunProcesses:
    """The node processes of a launch, with the interface that `ProcessMonitor` requires."""

    def __init__(self, run: LaunchRun, run_id: str, stop: Callable[[], None]) -> None:
        """Store the arguments. `stop` is the function that stops all nodes."""
        self._run = run
        self._run_id = run_id
        self._stop = stop
        self._known: dict[str, LocalProcess] = {}
        self._lock = threading.Lock()

    def watch_once(self, timeout_s: float | None = None) -> bool:
        return self._run.watch_once(timeout_s)

    def stop(self) -> None:
        self._stop()

    def of(self, managed: ManagedNode) -> LocalProcess:
        """Return the process of a node: the same object on each call."""
        with self._lock:
            if managed.name not in self._known:
                self._known[managed.name] = LocalProcess(self._run, self._run_id, managed)
            return self._known[managed.name]

    def alive(self) -> list[LocalProcess]:
        """Return the processes that have not ended for good; see `LocalProcess.is_watched`."""
        return [process for process in self.all() if process.is_watched]

    def ended(self) -> list[LocalProcess]:
        """Return the processes that have ended for good."""
        return [process for process in self.all() if not process.is_watched]

    def all(self) -> list[LocalProcess]:
        """Return all processes, running or exited, in start order."""
        return [self.of(managed) for managed in self._run.managed()]
