"""One run of `roslaunch` or `roscore` from start to end: log folder, launch files, master and nodes.

The output is the same as Noetic's. Users wait for the first node to start, so everything that can be
postponed is done afterwards.
"""

from __future__ import annotations

import itertools
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pipros
from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.master.options import MasterOptions
from pipros.net.master_client import MasterClient
from pipros_tools.launch.announcements import (
    announce_launch,
    summary,
    warn_about_arguments,
    warn_about_machines,
)
from pipros_tools.launch.command import CommandMaker
from pipros_tools.launch.console import Console
from pipros_tools.launch.find_launch_files import STDIN
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.logs import LauncherLog, disk_usage_report
from pipros_tools.launch.managed_node import ProcessInfo
from pipros_tools.launch.model import Launch
from pipros_tools.launch.param_upload import CALLER_ID
from pipros_tools.launch.placement import Placement
from pipros_tools.launch.roscore import ROS_COMM_VERSION, STANDARD_PARAMETERS
from pipros_tools.launch.run import LaunchRun
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.server import LaunchServer
from pipros_tools.launch.session_master import SessionMaster, choose_run_id
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex

if TYPE_CHECKING:
    from pipros_tools.launch.control import LaunchControl

_OWN_ADDRESS_TIMEOUT_S = 5.0


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """Options from the command line.

    Attributes:
        is_core: whether this is `roscore`, which reads no files and fails if a master is already running.
        port: the master's port; defaults to 11311 for `roscore`, otherwise to the port in `ROS_MASTER_URI`.
        master: other settings for a master that the session starts.
        run_id: id of the run; defaults to the running master's run id, or to a new id.
        has_summary: whether to print the summary.
        checks_log_folder: whether to check the size of the log folder.
        run: options for running the nodes.
    """

    is_core: bool = False
    port: int | None = None
    master: MasterOptions = field(default_factory=MasterOptions)
    run_id: str | None = None
    has_summary: bool = True
    checks_log_folder: bool = True
    run: RunOptions = field(default_factory=RunOptions)


class LaunchSession:
    """One run of the launcher.

    Call `start`, `wait` and `stop`, in this order; call `stop` even if `start` fails.
    """

    def __init__(
        self,
        files: Sequence[str],
        arguments: Mapping[str, str],
        options: SessionOptions,
        console: Console,
        *,
        environment: Environment | None = None,
        index: PackageIndex | None = None,
        load_launch: Callable[[], Launch] | None = None,
        numbers: Iterator[int] | None = None,
        has_server: bool = True,
        on_end: Callable[[str, int], None] | None = None,
    ) -> None:
        """Store the arguments. Nothing is started until `start()` is called.

        Args:
            load_launch: function that returns the launch; by default, it is read from the files.
            numbers, on_end: see `LaunchRun`.
            has_server: whether other programs can query and control the session's nodes.
        """
        environment = environment or Environment.from_os()
        self._files = list(files)
        self._arguments = arguments
        self._options = options
        self._console = console
        self._index = index or PackageIndex.from_environment(environment)
        self._load_launch = load_launch or self._load_files
        self._numbers = numbers or itertools.count(1)
        self._has_server = has_server
        self._on_end = on_end
        self._master = SessionMaster(
            environment,
            options.master,
            console,
            is_core=options.is_core,
            port=options.port,
            on_shutdown=self.request_stop,
        )
        self._environment = self._master.environment
        self._is_stop_requested = False
        self._is_interruptible = False
        self._server: LaunchServer | None = None
        self._run: LaunchRun | None = None
        self._control: LaunchControl | None = None
        self._failed: list[str] = []

    @property
    def run(self) -> LaunchRun:
        """The running nodes. Valid after `start`."""
        if self._run is None:
            raise RuntimeError("the session is not running; call start() first")
        return self._run

    @property
    def server(self) -> LaunchServer | None:
        """The server that answers queries about the processes; None before `start` or if disabled."""
        return self._server

    @property
    def failed(self) -> Sequence[str]:
        """Names of the nodes that could not be launched. Valid after `start`."""
        return tuple(self._failed)

    @property
    def owns_master(self) -> bool:
        """Whether this session started the master."""
        return self._master.is_own

    def start(self) -> None:
        """Load the launch files, then start the server, the master and the nodes.

        Raises:
            PiprosError, OSError: startup failed. Nothing is left running once `stop` has been called.
            KeyboardInterrupt: a stop was requested.
        """
        self._is_interruptible = True
        run_id = choose_run_id(self._options.run_id, self._master.find(), self._console)
        log = LauncherLog.open(self._environment, run_id, self._console)
        if self._options.checks_log_folder:
            self._check_log_folder(log)
        self._set_title()
        launch = self._load_launch()
        launch.check_machines()
        local_only = self._options.run.local_only
        announce_launch(self._console, launch, local_only=local_only)
        placement = Placement(launch.machines)
        has_remote_nodes = not local_only and any(map(placement.remote_machine, launch.nodes))
        self._is_interruptible = False
        if self._has_server:
            self._start_server()
        self._end_if_requested()
        if self._options.has_summary:
            self._print_summary(launch, has_remote_nodes=has_remote_nodes)
        self._start_master(run_id, log)
        self._end_if_requested()
        if has_remote_nodes:
            warn_about_machines(self._console, launch, self._master.uri)
        self._start_nodes(launch, placement, log)
        if self._has_server and launch.nodes:
            self._open_control(run_id)

    def wait(self) -> None:
        """Block until a stop is requested, a required node exits, or all nodes have exited.

        If this session started the master, do not return when all nodes have exited, because other programs
        may still use the master.
        """
        self.run.wait(until_all_ended=not self.owns_master)

    def request_stop(self) -> None:
        """Make `wait` return, or `start` raise KeyboardInterrupt.

        May be called repeatedly, and from a signal handler.

        Raises:
            KeyboardInterrupt: called in the main thread while `start` reads files; this part of `start` can
                be aborted at any point.
        """
        self._is_stop_requested = True
        if self._run is not None:
            self._run.request_stop()
        elif self._is_interruptible and threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt

    def stop(self) -> None:
        """Stop the nodes, then `/rosout`, then the master. May be called even if nothing was started."""
        say = self._console.say
        if self._control is not None:
            self._control.stop()
        if self._run is not None:
            self._run.stop()
        self._master.stop_rosout()
        if self._server is not None:
            if not self.owns_master:
                self._withdraw_server(self._server)
            self._server.stop()
        self._master.stop()
        if self._run is not None:
            say("shutting down processing monitor...")
            say("... shutting down processing monitor complete")
            self._console.bold("done")
        self._console.close()

    def _end_if_requested(self) -> None:
        """Abort `start` if a stop was requested. Called between steps, so that no step is left incomplete."""
        if self._is_stop_requested:
            raise KeyboardInterrupt

    def _check_log_folder(self, log: LauncherLog) -> None:
        self._console.say("Checking log directory for disk usage. This may take a while.")
        self._console.say("Press Ctrl-C to interrupt")
        self._console.say(disk_usage_report(log.folder.path.parent))

    def _set_title(self, uri: str = "") -> None:
        names = ["roscore"] if self._options.is_core else self._files
        self._console.title(" ".join([",".join(names), uri]).strip())

    def _load_files(self) -> Launch:
        texts = []
        if STDIN in self._files:
            print("Passed '-' as file argument, attempting to read roslaunch XML from stdin.", flush=True)
            texts.append(sys.stdin.read())
            print(f"... {len(texts[0])} bytes read successfully.\n", flush=True)
        files = [file for file in self._files if file != STDIN]
        launch = load(files, self._arguments, context=LoadContext.of_process(self._index), texts=texts)
        warn_about_arguments(self._console, launch, self._arguments, files)
        return launch

    def _start_server(self) -> None:
        children: list[str] = []  # always empty: ssh starts remote nodes without a child `roslaunch`
        server = LaunchServer(
            self._environment, self._processes, {"list_children": lambda: [1, "roslaunch children", children]}
        )
        server.start()
        self._server = server
        server.check_address(_OWN_ADDRESS_TIMEOUT_S)
        self._console.bold(f"started roslaunch server {server.uri}")
        if self._options.is_core:
            self._console.say(f"ros_comm version {ROS_COMM_VERSION}\npipros version {pipros.__version__}")

    def _processes(self) -> Sequence[ProcessInfo]:
        return self._run.processes() if self._run is not None else ()

    def _print_summary(self, launch: Launch, *, has_remote_nodes: bool) -> None:
        params = {**STANDARD_PARAMETERS, **launch.params}
        machines = launch.machines if has_remote_nodes else ()
        self._console.say(
            summary(
                params,
                launch.nodes,
                machines=machines,
                is_core=self._options.is_core,
                cleared=launch.clear_params,
            )
        )

    def _start_master(self, run_id: str, log: LauncherLog) -> None:
        self._master.start(run_id, log.folder.path)
        self._console.bold(f"ROS_MASTER_URI={self._master.uri}")
        self._set_title(self._master.uri)
        if self.owns_master:
            self._console.say(f"master {self._master.binding}")
        if self._master.sets_run_id:
            self._console.bold(f"setting /run_id to {run_id}")

    def _start_nodes(self, launch: Launch, placement: Placement, log: LauncherLog) -> None:
        """Set the parameters and start the nodes.

        If this session started the master, start `/rosout` while the nodes start up. `/rosout` gets the first
        process number.
        """
        if self.owns_master:
            next(self._numbers)  # as in Noetic, `/rosout` counts as the first process
        run = LaunchRun(
            launch,
            CommandMaker.for_launcher(self._environment, self._index, log.file),
            master_uri=self._master.uri,
            logs=log.folder,
            console=self._console,
            options=self._options.run,
            placement=placement,
            numbers=self._numbers,
            on_end=self._on_end,
        )
        self._publish_server()
        self._run = run
        if self._is_stop_requested:
            run.request_stop()
        run.set_parameters()
        if self.owns_master:
            self._console.bold(f"process[rosout-1]: started with pid [{os.getpid()}]")
            if not launch.nodes:
                self._master.start_rosout()
            self._console.say("started core service [/rosout]")
        self._failed += run.start_nodes()
        if launch.nodes:
            self._master.start_rosout()

    def _open_control(self, run_id: str) -> None:
        """Let pipros's web page stop and restart nodes. Called once the nodes have been started."""
        from pipros_tools.launch.control import LaunchControl

        control = LaunchControl(run_id, self._files, self.run)
        try:
            control.start()
        except OSError as error:
            self._console.detail(f"the web page cannot show this launch: {error}")
        else:
            self._control = control

    def _publish_server(self) -> None:
        if self._server is None:
            return
        client = MasterClient(self._master.uri, CALLER_ID)
        try:
            client.set_param(self._server.parameter, self._server.uri)
            if not self.owns_master:
                for key, value in STANDARD_PARAMETERS.items():
                    client.set_param(key, value)
        finally:
            client.close()

    def _withdraw_server(self, server: LaunchServer) -> None:
        client = MasterClient(self._master.uri, CALLER_ID, timeout_s=1.0)
        try:
            client.delete_param(server.parameter)
        except PiprosError:
            pass  # the master has exited, or the parameter has been deleted
        finally:
            client.close()
