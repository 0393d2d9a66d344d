"""Run the nodes of a launch file during a pytest test, on an existing master."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Thread
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros_tools.launch.command import CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.find_launch_files import resolve_files
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.run_id import new_run_id
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex


class NodesDidNotStart(PiprosError):
    """Some nodes in a launch file could not be started."""


class Launched:
    """The running nodes of a launch file, for use in a test.

    A thread monitors the nodes and restarts nodes with `respawn`, but stops doing so when a `required` node
    exits. The other nodes keep running until `stop` is called.

    Attributes:
        exit_codes: the exit code of each node that has exited, by node name.
    """

    def __init__(
        self, words: Sequence[str | Path], arguments: Mapping[str, Any], master_uri: str, *, folder: Path
    ) -> None:
        """Read the launch file. Call `start` to start the nodes.

        Args:
            words: a package and the name of a launch file in it, or the path of a launch file.
            arguments: arguments for the file; booleans and numbers are converted to text.
            folder: the folder that a relative path is resolved against.

        Raises:
            LaunchError: the file does not exist or is invalid.
        """
        environment = Environment.from_os()
        index = PackageIndex.from_environment(environment)
        names = [os.fspath(word) for word in words]
        if len(names) == 1:
            names = [str(folder / names[0])]
        texts = {name: _as_text(value) for name, value in arguments.items()}
        launch = load(resolve_files(names, index), texts, context=LoadContext.of_process(index))
        run_id = new_run_id()
        logs = LogFolder.of_run(environment, run_id)
        # Nothing is logged to this file; the guardian identifies this launch's nodes by its name.
        log = logs.file_of_launcher(f"pytest-{run_id}")
        self.exit_codes: dict[str, int] = {}
        self._run = LaunchRun(
            launch,
            CommandMaker.for_launcher(environment, index, log),
            master_uri=master_uri,
            logs=logs,
            console=Console(has_title=False),
            on_end=self._remember,
        )
        self._watcher = Thread(target=self._run.wait, kwargs={"until_all_ended": False}, daemon=True)

    def start(self) -> None:
        """Set the parameters and start the nodes.

        Raises:
            NodesDidNotStart: some nodes, which the error text names, failed to start. Others may be running.
            Unreachable, LaunchError: see `LaunchRun.set_parameters` and `LaunchRun.start_nodes`.
        """
        self._run.set_parameters()
        if failed := self._run.start_nodes():
            raise NodesDidNotStart(f"cannot start {', '.join(failed)}; see stderr for the reasons")
        self._watcher.start()

    @property
    def running(self) -> tuple[str, ...]:
        """The full names of the running nodes, such as `/robot/talker`."""
        return tuple(f"/{name.rpartition('-')[0]}" for name in self._run.running())

    def stop(self) -> None:
        """Stop all nodes with SIGINT, then SIGTERM, then SIGKILL, with pauses. May be called repeatedly."""
        self._run.request_stop()
        if self._watcher.ident is not None:
            self._watcher.join()
        self._run.stop()

    def _remember(self, name: str, exit_code: int) -> None:
        self.exit_codes[f"/{name.rpartition('-')[0]}"] = exit_code


def _as_text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
