"""The systems that rostest runs tests on: a master of their own or an existing one, and the file's nodes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from pipros.env import DEFAULT_MASTER_URI, Environment
from pipros.errors import PiprosError, Refused, Unreachable
from pipros.launch.announcements import summary
from pipros.launch.command import CannotLaunch, CommandMaker
from pipros.launch.console import Console
from pipros.launch.logs import LogFolder
from pipros.launch.model import Launch, Output, Test
from pipros.launch.roscore import STANDARD_PARAMETERS, Core
from pipros.launch.run import Run
from pipros.launch.run_id import is_run_id, new_run_id, run_id_problem
from pipros.net.master_client import MasterClient
from pipros.testing.rostest import TestProgramTimedOut
from pipros.workspace.index import PackageIndex

# Reports leave out the frames of modules with this mark: what failed is said in words.
__unittest = True

_CALLER_ID = "/rostest"

# What belongs to the master's own run, and stays when the parameters of others are cleared.
_KEPT_PARAMETERS = ("/run_id", "/rosversion", "/rosdistro")
_KEPT_NAMESPACE = "/roslaunch/"


class NoMasterToReuse(PiprosError):
    """`--reuse-master`, and no master answers."""


class RequiredNodeEnded(PiprosError):
    """A node that is `required` ended while a test ran."""


class LaunchStage:
    """Runs the tests of a launch file in this environment; see `pipros.testing.rostest.TestFixture`."""

    def __init__(
        self,
        launch: Launch,
        index: PackageIndex,
        environment: Environment,
        console: Console,
        *,
        reuse_master: bool = False,
        clear: bool = False,
        text: bool = False,
    ) -> None:
        """Nothing is started yet.

        Args:
            reuse_master: use the master of the environment instead of one of its own on a free port.
            clear: delete the parameters of that master first.
            text: test programs print to the console instead of to their log files.
        """
        self.run_id = new_run_id()
        self._launch = launch
        self._index = index
        self._environment = environment
        self._reuse_master = reuse_master
        self._clear = clear
        self._text = text
        self._console = console
        self._core: Core | None = None
        self._run: Run | None = None

    def set_up(self) -> None:
        """Has a master ready and prints what will run.

        Raises:
            NoMasterToReuse: none answers where one was to be reused.
            OSError: no port for one of its own.
        """
        if self._reuse_master:
            master_uri = self._environment.master_uri
            self._join(master_uri)
        else:
            # Whoever's master the environment names, this one is for the nodes on this computer.
            here = replace(self._environment, master_uri=DEFAULT_MASTER_URI)
            self._core = Core(port=0, run_id=self.run_id, rosout=False, environment=here)
            self._core.start()
            master_uri = self._core.uri
        self._console.say(summary({**STANDARD_PARAMETERS, **self._launch.params}, self._launch.nodes))
        self._run = Run(
            self._launch,
            CommandMaker.for_launcher(self._environment, self._index),
            master_uri=master_uri,
            logs=LogFolder.of_run(self._environment, self.run_id),
            console=self._console,
        )
        self._console.bold(f"ROS_MASTER_URI={master_uri}")

    def start_nodes(self) -> Sequence[str]:
        """Sets the parameters, then starts the nodes; the names of those that could not be started."""
        run = self._running()
        run.set_parameters()
        return run.start_nodes()

    def run_test(self, test: Test, arguments: Sequence[str]) -> bool:
        """Runs the test program to its end while the nodes are looked after; False when it did not start.

        Raises:
            TestProgramTimedOut: its time limit is over. It still runs until `tear_down`.
            RequiredNodeEnded: a node without which the launch file says that all is over.
        """
        run = self._running()
        node = test.node
        try:
            process = run.start(node, arguments, Output.SCREEN if self._text else Output.LOG)
        except CannotLaunch as error:
            self._console.error(f"ERROR: {error}")
            return False
        deadline = time.monotonic() + test.time_limit_s
        if run.watch(process, test.time_limit_s):
            return True
        if time.monotonic() < deadline:
            raise RequiredNodeEnded(f"a required node ended before the test [{test.test_name}]")
        raise TestProgramTimedOut(
            f"max time [{test.time_limit_s}s] allotted for test [{test.test_name}] "
            f"of type [{node.package}/{node.type}]"
        )

    def tear_down(self) -> None:
        """Ends the test, the nodes and the master of its own."""
        self._console.say("shutting down processing monitor...")
        run, self._run = self._run, None
        core, self._core = self._core, None
        try:
            if run is not None:
                run.stop()
        finally:
            if core is not None:
                core.stop()
        self._console.say("... shutting down processing monitor complete")

    def _running(self) -> Run:
        if self._run is None:
            raise RuntimeError("nothing runs before set_up")
        return self._run

    def _join(self, master_uri: str) -> None:
        master = MasterClient(master_uri, _CALLER_ID)
        try:
            with suppress(Refused):
                run_id = master.get_param("/run_id")
                if is_run_id(run_id):
                    self.run_id = run_id
                else:
                    problem = run_id_problem(run_id, "/run_id on the parameter server")
                    self._console.error(f"WARNING: {problem}. Using [{self.run_id}] instead")
            if self._clear:
                for name in master.get_param_names():
                    if name not in _KEPT_PARAMETERS and not name.startswith(_KEPT_NAMESPACE):
                        master.delete_param(name)
        except Unreachable as error:
            raise NoMasterToReuse(
                f"Could not connect to existing ROS master. Original exception was: {error.reason}"
            ) from None
        finally:
            master.close()
