"""`ROSLaunchRunner`, which executes a configuration."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.master.options import MasterOptions, limits_with_timeout
from pipros_tools.launch.command import CannotLaunch
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.session import LaunchSession, SessionOptions
from roslaunch.core import *  # noqa: F403  # as in Noetic
from roslaunch.core import (
    Executable,
    Machine,
    Master,
    Node,
    RLException,
    RosbinExecutable,
    Test,
    is_machine_local,
    printerrlog,
    printlog_bold,
)
from roslaunch.nodeprocess import (
    DEFAULT_TIMEOUT_SIGINT,
    DEFAULT_TIMEOUT_SIGTERM,
    NUM_WORKERS,
    LocalProcess,
    RunProcesses,
    process_numbers,
)
from roslaunch.pmon import ProcessListener, ProcessMonitor, start_process_monitor
from roslaunch.rlutil import update_terminal_name

if TYPE_CHECKING:
    from roslaunch.config import ROSLaunchConfig

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "NUM_WORKERS",
    "ProcessListener",
    "RLTestTimeoutException",
    "ROSLaunchListener",
    "ROSLaunchRunner",
    "ROSRemoteRunnerIF",
    "start_process_monitor",
    "update_terminal_name",
    "validate_master_launch",
]

_POLL_INTERVAL_S = 0.05


class RLTestTimeoutException(RLException):
    """A test exceeded its time limit."""


class ROSLaunchListener:
    """Base class of listeners that are notified when a launch's processes exit."""

    def process_died(self, process_name: str, exit_code: int | None) -> None:
        """Handle the exit of a process. Called after the exit was printed."""


class ROSRemoteRunnerIF:
    """Base class of runners that start nodes on other machines. pipros does not call their methods."""

    def setup(self) -> None:
        """Do nothing. Subclasses prepare the launch."""

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741  # Noetic's name
        """Do nothing. Subclasses add a listener for the exits of processes on other machines."""

    def launch_remote_nodes(self) -> tuple[list[str], list[str]]:
        """Return empty lists. Subclasses start nodes, and return the names of started and failed nodes."""
        return [], []


def validate_master_launch(m: Master, is_core: bool, is_rostest: bool = False) -> None:
    """Check that a master responds, or can be started on this computer.

    Raises:
        RLException: no master responds, its URI refers to another computer, and `is_core` is false.
    """
    _ = is_rostest
    host = m.get_host()
    if is_core or m.is_running() or is_machine_local(Machine("", host)):
        return
    raise RLException(
        f"ERROR: unable to contact ROS master at [{m.uri}]\n"
        "The traceback for the exception was written to the log file"
    )


class ROSLaunchRunner:
    """Runner that executes a configuration.

    It ensures that a master is running, sets parameters, and starts and monitors nodes. `launch` starts
    everything; `stop` stops everything. The attribute `runner` of `ROSLaunchParent` is such a runner.

    Attributes:
        pm: the monitor for the nodes' processes.
        config, run_id, server_uri: the constructor's arguments.
    """

    def __init__(
        self,
        run_id: str,
        config: ROSLaunchConfig,
        server_uri: str | None = None,
        pmon: ProcessMonitor | None = None,
        is_core: bool = False,
        remote_runner: ROSRemoteRunnerIF | None = None,
        is_child: bool = False,
        is_rostest: bool = False,
        num_workers: int = NUM_WORKERS,
        timeout: float | None = None,
        master_logger_level: object = False,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        if run_id is None:
            raise RLException("run_id is None")
        self.run_id = run_id
        self.config = config
        self.server_uri = server_uri
        self.is_core = is_core
        self.is_child = is_child
        self.is_rostest = is_rostest
        self.remote_runner = remote_runner
        self.num_workers = num_workers
        self.timeout = timeout
        self.master_logger_level = master_logger_level
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        self.logger = logging.getLogger("roslaunch")
        monitor = pmon or start_process_monitor()
        if monitor is None:
            raise RLException("cannot start a process monitor: the program is shutting down after a signal")
        self.pm = monitor
        self.listeners = self.pm.listeners
        self._session: LaunchSession | None = None
        self._processes: RunProcesses | None = None

    @classmethod
    def of_session(
        cls, session: LaunchSession, run_id: str, config: ROSLaunchConfig, pm: ProcessMonitor
    ) -> ROSLaunchRunner:
        """Return a runner for a started session, which `pm` then monitors."""
        runner = cls(run_id, config, None if session.server is None else session.server.uri, pm)
        runner._session = session
        runner._watch()
        return runner

    @property
    def session(self) -> LaunchSession:
        """The session passed to `of_session`; otherwise, a session that is created on first use."""
        if self._session is None:
            self._session = self._make_session()
        return self._session

    def _make_session(self) -> LaunchSession:
        return LaunchSession(
            [],
            {},
            SessionOptions(
                is_core=self.is_core,
                run_id=self.run_id,
                has_summary=False,
                checks_log_folder=False,
                master=MasterOptions(limits=limits_with_timeout(self.timeout)),
                run=RunOptions(
                    sigint_timeout_s=self.sigint_timeout,
                    sigterm_timeout_s=self.sigterm_timeout,
                    is_child=self.is_child,
                ),
            ),
            Console(has_title=False),
            environment=Environment.from_os(),
            load_launch=self.config.to_launch,
            numbers=process_numbers,
            has_server=False,
            on_end=self.pm.tell,
        )

    def launch(self) -> tuple[list[LocalProcess], list[str]]:
        """Start everything. Return the processes, and the names of the nodes that did not start.

        Raises:
            RLException: the master cannot be started, or rejects a parameter. Started processes keep running.
        """
        _check_executables(self.config.executables)
        self.session.start()
        self._watch()
        return self._run_processes().all(), list(self.session.failed)

    def launch_node(self, node: Node, core: bool = False) -> tuple[Any, bool]:
        """Start one node. If `core` is true, first set the node's `respawn` to True.

        Returns:
            The process and True, or the node's name and False if the node could not be started.
        """
        if core:
            node.respawn = True
        try:
            managed = self._run().start_managed(node.to_model())
        except CannotLaunch as error:
            printerrlog(f"ERROR: {error}")
            return node.name, False
        process = self._run_processes().of(managed)
        node.process_name = process.name
        return process, True

    def run_test(self, test: Test) -> None:
        """Run a test until it exits.

        Raises:
            RLTestTimeoutException: the test exceeded its time limit. It keeps running until `stop`.
            RLException: the test could not be started.
        """
        _, is_started = self.launch_node(test)
        if not is_started:
            raise RLException(f"test [{test.test_name}] failed to launch")
        deadline = time.monotonic() + test.time_limit
        while self.spin_once() and self.is_node_running(test):
            if time.monotonic() > deadline:
                raise RLTestTimeoutException(
                    f"max time [{test.time_limit}s] allotted for test [{test.test_name}] "
                    f"of type [{test.package}/{test.type}]"
                )
            time.sleep(_POLL_INTERVAL_S)

    def is_node_running(self, node: Node) -> bool:
        """Return whether the node's process is running or may be restarted, automatically or by a user."""
        return node.process_name is not None and self.pm.has_process(node.process_name)

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741  # Noetic's name
        """Add a listener that is notified of each process exit."""
        self.pm.add_process_listener(l)

    def spin_once(self) -> bool:
        """Return False if the launch is over."""
        return self.pm.mainthread_spin_once()

    def spin(self) -> None:
        """Block until the launch is over. If neither nodes nor its master run, print a message and stop."""
        if not self.pm.get_active_names() and not self.session.owns_master:
            printlog_bold("No processes to monitor")
            self.stop()
            return
        self.pm.mainthread_spin()

    def stop(self) -> None:
        """Stop everything that was started. May be called repeatedly."""
        self.pm.shutdown()
        if self.pm.ident is not None:
            self.pm.join()
        self.session.stop()

    def _watch(self) -> None:
        run = self.session.run
        self._processes = RunProcesses(run, self.run_id, run.stop)
        self.pm.watch(self._processes)
        process_names = {process.full_name: process.name for process in self._processes.all()}
        for node in self.config.nodes:
            node.process_name = process_names.get(names.join(node.namespace, node.name or ""))

    def _run(self) -> LaunchRun:
        try:
            return self.session.run
        except RuntimeError as error:
            raise RLException(str(error)) from error

    def _run_processes(self) -> RunProcesses:
        if self._processes is None:
            raise RLException("the runner has launched nothing yet; call launch() first")
        return self._processes


def _check_executables(executables: Sequence[Executable]) -> None:
    """Raise LaunchError for commands other than rosparam, because they could run arbitrary programs."""
    for executable in executables:
        if not isinstance(executable, RosbinExecutable) or executable.command != "rosparam":
            raise LaunchError(
                f"the command [{executable}] cannot be run: "
                "a configuration may only contain rosparam commands"
            )
