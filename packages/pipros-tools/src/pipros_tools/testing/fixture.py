"""The system in which rostest runs a test: a new or existing master, and the launch file's nodes."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress

from pipros.basics.env import DEFAULT_MASTER_URI, Environment
from pipros.basics.errors import PiprosError, Refused, Unreachable
from pipros.net.master_client import MasterClient
from pipros_tools.launch.announcements import summary
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.model import Launch, Output, Test
from pipros_tools.launch.roscore import STANDARD_PARAMETERS, Core
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.run_id import is_run_id, new_run_id, run_id_problem
from pipros_tools.testing.rostest import RequiredNodeEnded, TestProgramTimedOut
from pipros_workspace.index import PackageIndex

# unittest's reports omit the frames of modules that define this variable.
__unittest = True

_CALLER_ID = "/rostest"

# The master's own parameters, which --clear does not delete.
_KEPT_PARAMETERS = ("/run_id", "/rosversion", "/rosdistro")
_KEPT_NAMESPACE = "/roslaunch/"


class NoMasterToReuse(PiprosError):
    """The master does not respond, but `--reuse-master` requires an existing one."""


class LaunchFixture:
    """Fixture for a launch file's tests; implements `pipros_tools.testing.rostest.SystemFixture`."""

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
        port: int = 0,
    ) -> None:
        """Store the arguments; `set_up` starts or finds the master.

        Args:
            reuse_master: whether to use the master at `ROS_MASTER_URI` instead of starting one on a free
                port.
            clear: whether to first delete the parameters on the existing master, except the master's own.
            text: whether test programs print to the console instead of their log files.
            port: the port for a new master; 0 for a free port.
        """
        self.run_id = new_run_id()
        self._launch = launch
        self._index = index
        self._environment = environment
        self._reuse_master = reuse_master
        self._clear = clear
        self._text = text
        self._port = port
        self.master_uri = environment.master_uri
        self._console = console
        self._core: Core | None = None
        self._run: LaunchRun | None = None

    def set_up(self) -> None:
        """Start or find the master, and print the launch summary.

        Raises:
            NoMasterToReuse: the existing master does not respond.
            OSError: no port is available for a new master.
        """
        if self._reuse_master:
            self._join(self.master_uri)
        else:
            # The new master is on this computer, even if ROS_MASTER_URI refers to another one.
            local = self._environment._replace(master_uri=DEFAULT_MASTER_URI)
            self._core = Core(port=self._port, run_id=self.run_id, rosout=False, environment=local)
            self._core.start()
            self.master_uri = self._core.uri
        self._console.say(summary({**STANDARD_PARAMETERS, **self._launch.params}, self._launch.nodes))
        self._run = LaunchRun(
            self._launch,
            CommandMaker.for_launcher(self._environment, self._index),
            master_uri=self.master_uri,
            logs=LogFolder.of_run(self._environment, self.run_id),
            console=self._console,
        )
        self._console.bold(f"ROS_MASTER_URI={self.master_uri}")

    def start_nodes(self) -> Mapping[str, str]:
        """Set the parameters, then start the nodes. Return the names of those that fail, with the reasons."""
        run = self._running()
        run.set_parameters()
        return run.start_nodes()

    def run_test(self, test: Test, arguments: Sequence[str]) -> bool:
        """Run the test program until it exits, monitoring the nodes; return False if it did not start.

        Raises:
            TestProgramTimedOut: the program exceeded its time limit. It keeps running until `tear_down`.
            RequiredNodeEnded: a `required` node exited first.
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
            raise RequiredNodeEnded(f"a required node exited before the test [{test.test_name}] ended")
        raise TestProgramTimedOut(
            f"max time [{test.time_limit_s}s] allotted for test [{test.test_name}] "
            f"of type [{node.package}/{node.type}]"
        )

    def tear_down(self) -> None:
        """Stop the test program, the nodes, and the master if this fixture started it."""
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

    @property
    def run(self) -> LaunchRun:
        """The running launch. Valid after `set_up`."""
        return self._running()

    def _running(self) -> LaunchRun:
        if self._run is None:
            raise RuntimeError("set_up must be called first")
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
