"""A launched process, under Noetic's names."""

from __future__ import annotations

from typing import Any

from pipros.launch.process import NodeProcess
from pipros.launch.run import Run


class ProcessListener:
    """Is called at the end of each process; to be subclassed."""

    def process_died(self, process_name: str, exit_code: int) -> None:
        """Called after the end of a process was printed."""


class Process:
    """The handle that `ROSLaunch.launch` gives."""

    def __init__(self, process: NodeProcess, run: Run, package: str) -> None:
        self._process = process
        self._run = run
        self.package = package
        self.name = process.name
        self.args = list(process.command.argv)

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        return self._process.exit_code

    def is_alive(self) -> bool:
        return self._process.exit_code is None

    def stop(self, errors: list[str] | None = None) -> None:
        """Ends the process: SIGINT, SIGTERM, SIGKILL. Returns when it has ended."""
        _ = errors
        self._run.end_one(self._process)

    def get_exit_description(self) -> str:
        if self.exit_code:
            return (
                f"process has died [pid {self.pid}, exit code {self.exit_code}, cmd {' '.join(self.args)}]."
            )
        return "process has finished cleanly"

    def get_info(self) -> dict[str, Any]:
        return {"name": self.name, "alive": self.is_alive(), "pid": self.pid, "exit_code": self.exit_code}
