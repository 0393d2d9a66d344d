"""`ROSTestLaunchParent`: a launch with a master of its own, on which tests run."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.console import Console
from pipros.testing.fixture import LaunchFixture, RequiredNodeEnded
from pipros.testing.rostest import TestProgramTimedOut
from pipros.workspace.index import PackageIndex
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import FileAndArguments, Master, RLException, Test, printlog_bold
from roslaunch.launch import RLTestTimeoutException
from roslaunch.parent import ROSLaunchParent

__all__ = ["RLException", "ROSTestLaunchParent", "printlog_bold"]

_star_names(__name__, "logging rospy.core:logwarn rosmaster.master:Master rosgraph roslaunch sys")


class ROSTestLaunchParent(ROSLaunchParent):
    """`setUp()`, `launch()`, `run_test()` for each test, `tearDown()`."""

    def __init__(
        self,
        config: ROSLaunchConfig,
        roslaunch_files: Sequence[FileAndArguments],
        port: int = 0,
        reuse_master: bool = False,
        clear: bool = False,
    ) -> None:
        if config is None:
            raise ValueError("config not initialized")
        self._fixture = LaunchFixture(
            config.to_launch(),
            PackageIndex.from_environment(),
            Environment.from_os(),
            Console(has_title=False),
            reuse_master=reuse_master,
            clear=clear,
            port=port,
        )
        super().__init__(self._fixture.run_id, roslaunch_files, is_core=False, is_rostest=True, port=port)
        self.config: ROSLaunchConfig = config
        self.reuse_master = reuse_master
        self.master: Master | None = None
        self._is_set_up = False

    def _load_config(self) -> None:
        """Does nothing: the configuration was given."""

    def setUp(self) -> None:  # unittest's name
        """Starts the master, or finds the one to be used.

        Raises:
            RLException: it does not answer, or there is no port.
        """
        self._fixture.set_up()
        self._is_set_up = True
        self.config.master.uri = self._fixture.master_uri
        self.master = self.config.master

    def tearDown(self) -> None:
        """Ends everything that was started. May be repeated."""
        if self._is_set_up:
            self._is_set_up = False
            self.master = None
            self._fixture.tear_down()

    def launch(self) -> tuple[list[str], list[str]]:
        """Sets the parameters and starts the nodes, but no tests.

        Returns:
            The names of the processes that run, and of the nodes that did not start.

        Raises:
            RuntimeError: before `setUp`.
        """
        if not self._is_set_up:
            raise RuntimeError("no runner to launch")
        failed = list(self._fixture.start_nodes())
        return list(self._fixture.run.running()), failed

    def run_test(self, test: Test) -> None:
        """Runs a test to its end.

        Raises:
            RLTestTimeoutException: its time limit is over; it runs until `tearDown`.
            RLException: it could not be started, or a required node ended.
            RuntimeError: before `setUp`.
        """
        if not self._is_set_up:
            raise RuntimeError("no runner")
        try:
            is_started = self._fixture.run_test(test.to_test(), [])
        except TestProgramTimedOut as error:
            raise RLTestTimeoutException(str(error)) from error
        except RequiredNodeEnded as error:
            raise RLException(str(error)) from error
        if not is_started:
            raise RLException(f"test [{test.test_name}] failed to launch")

    def shutdown(self) -> None:
        self.tearDown()
