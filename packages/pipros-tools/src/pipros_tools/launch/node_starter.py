"""Start the processes of a launch's nodes, the first time and again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipros_tools.launch.command import CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.guardian import Guardian
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.managed_node import ManagedNode
from pipros_tools.launch.model import LaunchNode, Output
from pipros_tools.launch.placement import Placement
from pipros_tools.launch.process import NodeProcess
from pipros_tools.launch.run_options import RunOptions


class NodeStarter:
    """Starts processes, and the guardian that ends them if the launch is killed. Not thread-safe."""

    def __init__(
        self,
        maker: CommandMaker,
        master_uri: str,
        params: Mapping[str, Any],
        *,
        logs: LogFolder,
        console: Console,
        options: RunOptions,
        placement: Placement,
        numbers: Iterator[int],
        on_exit: Callable[[NodeProcess], None],
    ) -> None:
        """Store the arguments. `numbers` are at the end of process names."""
        self._maker = maker
        self._master_uri = master_uri
        self._params = params
        self._logs = logs
        self._console = console
        self._options = options
        self._placement = placement
        self._numbers = numbers
        self._on_exit = on_exit
        self._guardian = Guardian(maker.tag)

    def prepare(
        self, node: LaunchNode, extra_arguments: Sequence[str] = (), output: Output | None = None
    ) -> ManagedNode:
        """Return a node that has not been started; see `LaunchRun.start` for the arguments.

        Raises:
            CannotLaunch: the program does not exist.
        """
        self._guardian.start()
        number = next(self._numbers)
        name = f"{node.full_name.lstrip('/')}-{number}"
        command = self._maker.make(
            node,
            self._master_uri,
            log_stem=self._logs.stem(name),
            machine=self._placement.remote_machine(node),
            extra_arguments=extra_arguments,
            params=self._params,
        )
        output = output or self._options.output or node.output or Output.LOG
        return ManagedNode(name, node, command, output, number)

    def start(self, managed: ManagedNode) -> None:
        """Start a process of a node. Whether it is a restart follows from `restart_at`.

        Raises:
            CannotLaunch: the process cannot be started.
        """
        is_logged, is_child = managed.output is Output.LOG, self._options.is_child
        is_again = managed.restart_at is not None
        managed.restart_at = None
        managed.is_stopped = False
        managed.process = managed.latest = NodeProcess(
            managed.name,
            managed.command,
            stdout_log=self._output_file(managed, "stdout") if is_logged or is_child else None,
            stderr_log=self._output_file(managed, "stderr") if is_logged and is_child else None,
            guardian=self._guardian,
            on_exit=self._on_exit,
            restarts=is_again,
            colour=managed.number if self._options.has_prefixes else None,
        )
        managed.spawn_count += 1
        self._console.bold(f"process[{managed.name}]: started with pid [{managed.process.pid}]")

    def close(self) -> None:
        """Stop the guardian. Call this once all processes have ended."""
        self._guardian.stop()

    def _output_file(self, managed: ManagedNode, stream: str) -> Path | None:
        """Return the file for a node's output; None, the console, if the folder was unusable at the start."""
        if self._logs.is_usable:
            return Path(f"{self._logs.stem(managed.name)}-{stream}.log")
        return Path(os.devnull) if self._options.is_child else None
