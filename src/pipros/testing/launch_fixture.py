"""A launch file that runs beside a test: its nodes on a master that is there already."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Thread
from typing import Any

from pipros.env import Environment
from pipros.errors import PiprosError
from pipros.launch.command import CommandMaker
from pipros.launch.console import Console
from pipros.launch.find_launch_files import resolve_files
from pipros.launch.load_context import LoadContext
from pipros.launch.logs import LogFolder
from pipros.launch.run import Run
from pipros.launch.run_id import new_run_id
from pipros.launch.xml import load
from pipros.workspace.index import PackageIndex


class NodesDidNotStart(PiprosError):
    """Nodes of a launch file have no program, or it could not be started."""


class Launched:
    """The nodes of a launch file while a test runs.

    They are looked after in a thread: those that want it are started again, and when a `required` one
    ended, nothing is. All are ended by `stop` only.

    Attributes:
        exit_codes: of the nodes that ended so far, by name.
    """

    def __init__(
        self, words: Sequence[str | Path], arguments: Mapping[str, Any], master_uri: str, *, folder: Path
    ) -> None:
        """Reads the file; nothing is started yet.

        Args:
            words: `package file`, or the path of a file.
            arguments: of the file; booleans and numbers become what launch files call them.
            folder: what a relative path begins at.

        Raises:
            LaunchError: there is no such file, or it is wrong.
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
        # No log is written there, but the guardian finds the nodes of this launch by the name.
        log = logs.file_of_launcher(f"pytest-{run_id}")
        self.exit_codes: dict[str, int] = {}
        self._run = Run(
            launch,
            CommandMaker.for_launcher(environment, index, log),
            master_uri=master_uri,
            logs=logs,
            console=Console(has_title=False),
            on_end=self._remember,
        )
        self._watcher = Thread(target=self._run.wait, kwargs={"until_all_ended": False}, daemon=True)

    def start(self) -> None:
        """Sets the parameters and starts the nodes.

        Raises:
            NodesDidNotStart: naming them. Others may run.
        """
        self._run.set_parameters()
        if failed := self._run.start_nodes():
            raise NodesDidNotStart(f"could not be started: {', '.join(failed)}. The reasons are on stderr")
        self._watcher.start()

    @property
    def running(self) -> tuple[str, ...]:
        """The names of the nodes that run, in the graph: `/robot/talker`."""
        return tuple(f"/{name.rpartition('-')[0]}" for name in self._run.running())

    def stop(self) -> None:
        """Ends all nodes: SIGINT, SIGTERM after a while, SIGKILL after another. Harmless when repeated."""
        self._run.request_stop()
        if self._watcher.ident is not None:
            self._watcher.join()
        self._run.stop()

    def _remember(self, name: str, exit_code: int) -> None:
        self.exit_codes[f"/{name.rpartition('-')[0]}"] = exit_code


def _as_text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
