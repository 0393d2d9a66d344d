"""A node and its restarts, and the process information that other programs can query."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from pipros_tools.launch.command import NodeCommand
from pipros_tools.launch.model import LaunchNode, Output
from pipros_tools.launch.process import NodeProcess


class ProcessInfo(NamedTuple):
    """A snapshot of one process in a launch. If the node has been restarted, this is its latest process.

    Attributes:
        name: the process's name in messages, such as `talker-2`.
        exit_code: the exit code, negative if a signal killed the process; None while it is running.
        spawn_count: number of times the node was started.
        environment: the variables that the launch file and the launcher set.
    """

    name: str
    node: LaunchNode
    pid: int
    exit_code: int | None
    spawn_count: int
    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    has_log: bool = True

    @property
    def is_alive(self) -> bool:
        return self.exit_code is None

    def as_struct(self) -> dict[str, Any]:
        """Return the result of the call `process_info`, with Noetic's names."""
        struct = {
            "name": self.name,
            "package": self.node.package,
            "pid": self.pid,
            "alive": self.is_alive,
            "spawn_count": self.spawn_count,
            "args": list(self.arguments),
            "env": dict(self.environment),
            "respawn": self.node.respawn,
            "respawn_delay": self.node.respawn_delay_s,
            "required": self.node.required,
            "log_output": self.has_log,
        }
        return struct if self.exit_code is None else {**struct, "exit_code": self.exit_code}


class NodeState(Enum):
    """The state of a node in a launch. The values are shown to users."""

    RUNNING = "running"
    ENDING = "ending"
    RESTARTING = "restarting"
    STOPPED = "stopped"
    EXITED = "exited"


class AfterExit(Enum):
    """Action to take once a node's current process has exited."""

    AS_DECLARED = "as declared"
    STAY_STOPPED = "stay stopped"
    START_AGAIN = "start again"


@dataclass(slots=True, eq=False, repr=False)
class ManagedNode:
    """A node and its processes.

    Attributes:
        process: the current process; None while the node waits for a restart or has ended.
        left_behind: a process that has exited, but whose child processes are still running.
        restart_at: time at which to restart the node, on the monotonic clock; None if no restart is due.
        latest: the latest process, whether or not it is still running.
        after_exit: action that a user requested; by default, the launch file determines the action.
        is_stopped: whether a user stopped the node. The launch continues, because it may be started again.
    """

    name: str
    node: LaunchNode
    command: NodeCommand
    output: Output
    number: int
    process: NodeProcess | None = None
    left_behind: NodeProcess | None = None
    restart_at: float | None = None
    latest: NodeProcess | None = None
    spawn_count: int = 0
    after_exit: AfterExit = AfterExit.AS_DECLARED
    is_stopped: bool = False

    @property
    def state(self) -> NodeState:
        if self.process is not None:
            return NodeState.RUNNING if self.after_exit is AfterExit.AS_DECLARED else NodeState.ENDING
        if self.restart_at is not None:
            return NodeState.RESTARTING
        return NodeState.STOPPED if self.is_stopped else NodeState.EXITED

    @property
    def is_done(self) -> bool:
        if self.left_behind is not None and not self.left_behind.has_group:
            self.left_behind = None
        is_idle = self.process is None and self.left_behind is None and self.restart_at is None
        return is_idle and not self.is_stopped

    def info(self) -> ProcessInfo:
        """Return a snapshot of the current state. The node must have been started."""
        assert self.latest is not None  # noqa: S101  # was started
        return ProcessInfo(
            name=self.name,
            node=self.node,
            pid=self.latest.pid,
            exit_code=self.latest.exit_code,
            spawn_count=self.spawn_count,
            arguments=self.command.argv,
            environment=self.command.overlay,
            has_log=self.output is Output.LOG,
        )
