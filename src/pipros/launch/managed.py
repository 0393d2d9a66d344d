"""A node that is being run, over all of its restarts."""

from __future__ import annotations

from dataclasses import dataclass

from pipros.launch.command import Command
from pipros.launch.model import Node, Output
from pipros.launch.process import NodeProcess
from pipros.launch.report import ProcessReport


@dataclass(slots=True)
class ManagedNode:
    """A node and what became of it.

    Attributes:
        process: its process of the moment; None between the end of one and the start of the next.
        left_behind: its ended process, as long as something that it started still runs.
        restart_at: when it is to be started again.
        latest: its newest process, whether it runs or has ended.
    """

    name: str
    node: Node
    command: Command
    output: Output
    number: int
    process: NodeProcess | None = None
    left_behind: NodeProcess | None = None
    restart_at: float | None = None
    latest: NodeProcess | None = None
    spawn_count: int = 0

    @property
    def is_done(self) -> bool:
        if self.left_behind is not None and not self.left_behind.has_group:
            self.left_behind = None
        return self.process is None and self.left_behind is None and self.restart_at is None

    def report(self) -> ProcessReport:
        """What it is and does at the moment. To be called once it was started."""
        assert self.latest is not None  # noqa: S101  # was started
        return ProcessReport(
            name=self.name,
            package=self.node.package,
            pid=self.latest.pid,
            exit_code=self.latest.exit_code,
            spawn_count=self.spawn_count,
            arguments=self.command.argv,
            environment=self.command.overlay,
            respawn=self.node.respawn,
            respawn_delay_s=self.node.respawn_delay_s,
            required=self.node.required,
            has_log=self.output is Output.LOG,
        )
