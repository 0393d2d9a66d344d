"""`ROSTestLaunchParent`: a launch with its own master, in which tests run."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.launch.console import Console
from pipros_tools.testing.fixture import LaunchFixture
from pipros_tools.testing.rostest import RequiredNodeEnded, TestProgramTimedOut
from pipros_workspace.index import PackageIndex
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import FileAndArguments, Master, RLException, Test, printlog_bold
from roslaunch.launch import RLTestTimeoutException
from roslaunch.parent import ROSLaunchParent

__all__ = ["RLException", "ROSTestLaunchParent", "printlog_bold"]

_star_names(__name__, "logging rospy.core:logwarn rosmaster.master:Master rosgraph roslaunch sys")


class ROSTestLaunchParent(ROSLaunchParent):
    """A launch that runs tests: call `setUp()`, `launch()`, `run_test()` for each test, then `tearDown()`."""

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
        """Do nothing: the constructor received the configuration."""

    def setUp(self) -> None:  # unittest requires this name
        """Start the master, or find the existing master.

        Raises:
            RLException: the existing master does not respond, or no port is available.
        """
        self._fixture.set_up()
        self._is_set_up = True
        self.config.master.uri = self._fixture.master_uri
        self.master = self.config.master

    def tearDown(self) -> None:
        """Stop everything that was started. May be called repeatedly."""
        if self._is_set_up:
            self._is_set_up = False
            self.master = None
            self._fixture.tear_down()

    def launch(self) -> tuple[list[str], list[str]]:
        """Set the parameters and start the nodes, but not the tests.

        Returns:
            The names of the running processes, and the names of the nodes that did not start.

        Raises:
            RuntimeError: `setUp` was not called.
        """
        if not self._is_set_up:
            raise RuntimeError("no runner to launch")
        failed = list(self._fixture.start_nodes())
        return list(self._fixture.run.running()), failed

    def run_test(self, test: Test) -> None:
        """Run a test until it exits.

        Raises:
            RLTestTimeoutException: the test exceeded its time limit; it keeps running until `tearDown`.
            RLException: the test could not be started, or a required node exited.
            RuntimeError: `setUp` was not called.
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
