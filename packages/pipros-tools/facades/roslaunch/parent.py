"""`ROSLaunchParent`, which launches files from a script."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from pipros.basics.env import Environment
from pipros.master.options import MasterOptions, limits_with_timeout
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import Launch
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.server import LaunchServer
from pipros_tools.launch.session import LaunchSession, SessionOptions
from roslaunch.config import ROSLaunchConfig, load_config_default
from roslaunch.core import FileAndArguments, RLException, printerrlog, printlog_bold
from roslaunch.launch import ROSLaunchRunner
from roslaunch.nodeprocess import (
    DEFAULT_TIMEOUT_SIGINT,
    DEFAULT_TIMEOUT_SIGTERM,
    NUM_WORKERS,
    process_numbers,
)
from roslaunch.pmon import ProcessListener, ProcessMonitor, start_process_monitor

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "NUM_WORKERS",
    "RLException",
    "ROSLaunchParent",
    "load_config_default",
    "printerrlog",
    "printlog_bold",
]


class ROSLaunchParent:
    """A launch controlled by a script: call `start()`, then `spin()` or `spin_once()`, then `shutdown()`.

    Between `start` and `shutdown`, a thread monitors the nodes.

    Attributes:
        config: the configuration to launch; None until it is loaded. Scripts can change it before `start`.
        pm: the process monitor; None before `start`.
        runner, server: the runner and the XML-RPC server of the launch; None before `start`.
    """

    def __init__(
        self,
        run_id: str,
        roslaunch_files: Sequence[FileAndArguments],
        is_core: bool = False,
        port: int | None = None,
        local_only: bool = False,
        process_listeners: Sequence[ProcessListener] | None = None,
        verbose: bool = False,
        force_screen: bool = False,
        force_log: bool = False,
        is_rostest: bool = False,
        roslaunch_strs: Sequence[str] | None = None,
        num_workers: int = NUM_WORKERS,
        timeout: float | None = None,
        master_logger_level: object = False,
        show_summary: bool = True,
        force_required: bool = False,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        self._run_options = RunOptions(
            local_only=local_only, sigint_timeout_s=sigint_timeout, sigterm_timeout_s=sigterm_timeout
        )
        self.logger = logging.getLogger("roslaunch.parent")
        self.run_id = run_id
        self.process_listeners = process_listeners
        self.roslaunch_files = roslaunch_files
        self.roslaunch_strs = roslaunch_strs
        self.is_core = is_core
        self.is_rostest = is_rostest
        self.port = port
        self.local_only = local_only
        self.verbose = verbose
        self.show_summary = show_summary
        self.num_workers = num_workers
        self.timeout = timeout
        self.master_logger_level = master_logger_level
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        self.force_screen = force_screen
        self.force_log = force_log
        self.force_required = force_required
        self.config: ROSLaunchConfig | None = None
        self.runner: ROSLaunchRunner | None = None
        self.server: LaunchServer | None = None
        self.pm: ProcessMonitor | None = None
        self.remote_runner: object = None
        self.session: LaunchSession | None = None
        self._is_over = False

    def _load_config(self) -> None:
        """Load the files, for scripts that change the configuration before `start`.

        Raises:
            RLException: a file is invalid.
            ValueError: `force_required` is true, and a node has `respawn` set.
        """
        config = load_config_default(
            self.roslaunch_files, self.port, roslaunch_strs=self.roslaunch_strs, verbose=self.verbose
        )
        for node in config.nodes:
            if self.force_screen:
                node.output = "screen"
            if self.force_log:
                node.output = "log"
            if self.force_required:
                if node.respawn:
                    raise ValueError("respawn and required cannot both be set to true")
                node.required = True
        self.config = config

    def start(self, auto_terminate: bool = True) -> None:
        """Start a master unless one responds, set the parameters and start the nodes.

        Args:
            auto_terminate: whether the launch ends when all nodes have exited. Ignored if the launch started
                the master.

        Raises:
            RLException: a file is invalid, or the master cannot be started or rejects a parameter. Nothing is
                left running.
        """
        session = self.session = self._make_session()
        try:
            session.start()
        except BaseException:
            self.shutdown()
            raise
        assert self.config is not None  # noqa: S101  # set when the session called _load
        assert self.pm is not None  # noqa: S101  # set by _make_session
        self.runner = ROSLaunchRunner.of_session(session, self.run_id, self.config, self.pm)
        self.server = session.server
        if auto_terminate and not session.owns_master:
            self.pm.registrations_complete()
        for listener in self.process_listeners or ():
            self.pm.add_process_listener(listener)

    def spin_once(self) -> bool:
        """Return False if the launch is over."""
        return self.runner is not None and self.runner.spin_once()

    def spin(self) -> None:
        """Block until the launch is over or Ctrl-C is pressed, then end the remaining processes.

        Raises:
            RLException: the launch was not started.
        """
        if self.runner is None:
            raise RLException("parent not started yet")
        try:
            self.runner.spin()
        except KeyboardInterrupt:
            pass  # As in Noetic, Ctrl-C ends the launch and the script continues.
        finally:
            self.shutdown()

    def shutdown(self) -> None:
        """Stop everything that was started. May be called repeatedly."""
        if self._is_over:
            return
        self._is_over = True
        if self.pm is not None:
            self.pm.shutdown()
            self.pm.join()
        if self.session is not None:
            self.session.stop()

    def _make_session(self) -> LaunchSession:
        if self.pm is None:
            self.pm = start_process_monitor()
        if self.pm is None:
            raise RLException("cannot start a process monitor: the program is shutting down after a signal")
        return LaunchSession(
            [entry if isinstance(entry, str) else entry[0] for entry in self.roslaunch_files],
            {},
            SessionOptions(
                is_core=self.is_core,
                port=self.port,
                run_id=self.run_id,
                has_summary=self.show_summary,
                checks_log_folder=False,
                master=MasterOptions(limits=limits_with_timeout(self.timeout)),
                run=self._run_options,
            ),
            Console(has_title=False),
            environment=Environment.from_os(),
            load_launch=self._load,
            numbers=process_numbers,
            on_end=self.pm.tell,
        )

    def _load(self) -> Launch:
        if self.config is None:
            self._load_config()
        assert self.config is not None  # noqa: S101  # set by _load_config
        return self.config.to_launch()
