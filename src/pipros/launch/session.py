"""All of one `roslaunch`, `roscore` included: log folder, launch files, master, nodes, and the end of them.

The steps print what Noetic's roslaunch prints, in its order; the time between the call and the first node
is what people wait for, so what can be done later is done later.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipros.env import Environment, split_master_uri
from pipros.errors import PiprosError
from pipros.launch.command import CommandMaker
from pipros.launch.console import Console
from pipros.launch.core import ROS_COMM_VERSION, STANDARD_PARAMETERS, Core, new_run_id
from pipros.launch.files import STDIN
from pipros.launch.logs import LogFolder, disk_usage_report
from pipros.launch.model import Launch, LaunchError
from pipros.launch.report import ProcessReport
from pipros.launch.run import Run, RunOptions
from pipros.launch.server import LaunchServer
from pipros.launch.summary import summary
from pipros.launch.surroundings import Surroundings
from pipros.launch.upload import CALLER_ID
from pipros.launch.whereabouts import is_here, is_this_computer, master_environment, run_id_of
from pipros.launch.xml import load
from pipros.net import address
from pipros.net.master import MasterClient
from pipros.workspace.index import PackageIndex

_MASTER_ANSWERS_WITHIN_S = 5.0


@dataclass(frozen=True, slots=True)
class SessionOptions:
    """What the command line may ask for.

    Attributes:
        is_core: whether this is `roscore`: no files, and a master must not be there yet.
        port: where to start the master, when the environment's choice is not wanted.
        bind: the address that a master of ours listens on, when the environment's choice is not wanted.
        allow, store, notice_timeout_s, master_logger_level: for that master, as of `Core`.
        run_id: the run to belong to; by default that of the running master, or a new one.
    """

    is_core: bool = False
    port: int | None = None
    bind: str | None = None
    allow: tuple[str, ...] = ()
    store: Path | None = None
    notice_timeout_s: float | None = None
    master_logger_level: str | None = None
    run_id: str | None = None
    has_summary: bool = True
    checks_log_folder: bool = True
    run: RunOptions = field(default_factory=RunOptions)


class Session:
    """One run of the launcher. `start`, `wait`, `stop`, in this order; `stop` always."""

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
        on_end: Callable[[str, int], None] | None = None,
    ) -> None:
        """Nothing is started yet.

        Args:
            load_launch: gives the launch, when it does not simply come from the files.
            on_end: as of `Run`.
        """
        environment = environment or Environment.from_os()
        self._files = list(files)
        self._arguments = arguments
        self._options = options
        self._console = console
        self._index = index or PackageIndex.from_environment(environment)
        self._environment = master_environment(
            environment, is_core=options.is_core, port=options.port, bind=options.bind
        )
        self._ordered_uri = environment.master_uri
        self._load_launch = load_launch
        self._on_end = on_end
        self._is_master_there = False
        self._is_unwanted = False
        self._is_interruptible = False
        self._has_far_nodes = False
        self._core: Core | None = None
        self._server: LaunchServer | None = None
        self._run: Run | None = None
        self.run_id = ""
        self.launch = Launch()

    @property
    def master_uri(self) -> str:
        return self._environment.master_uri

    @property
    def run(self) -> Run:
        """The nodes. Valid from `start` on."""
        if self._run is None:
            raise RuntimeError("the session is not running; call start() first")
        return self._run

    @property
    def owns_master(self) -> bool:
        """Whether the master was started by this session."""
        return self._core is not None

    def start(self) -> None:
        """Brings everything up.

        Raises:
            PiprosError, OSError: with nothing left running, once `stop` was called.
        """
        self._is_interruptible = True
        self._open_logs()
        self._set_title()
        self._load()
        self._is_interruptible = False
        self._start_server()
        self._check_wanted()
        if self._options.has_summary:
            self._say_summary()
        self._start_master()
        self._check_wanted()
        self._warn_about_machines()
        self._warn_about_passwords()
        self._start_nodes()

    def wait(self) -> None:
        """Returns when it is time to stop: on request, at the end of a required node, or of all nodes.

        A session that started the master stays for others, who may use it.
        """
        assert self._run is not None  # noqa: S101  # start() was called
        self._run.wait(until_all_ended=self._core is None)

    def request_stop(self) -> None:
        """Ends `wait`, or the coming up; may be called from a signal handler, and again by the impatient.

        Raises:
            KeyboardInterrupt: in the main thread while that reads files, which may end anywhere.
        """
        self._is_unwanted = True
        if self._run is not None:
            self._run.request_stop()
        elif self._is_interruptible and threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt

    def stop(self) -> None:
        """Ends the nodes, then `/rosout`, then the master. Harmless when nothing was started."""
        say = self._console.say
        if self._run is not None:
            self._run.stop()
        if self._core is not None:
            say("[rosout-1] killing on exit")
            self._core.stop_rosout()
            say("[master] killing on exit")
        if self._server is not None:
            if self._core is None:
                self._forget_server(self._server)
            self._server.stop()
        if self._core is not None:
            self._core.stop()
        if self._run is not None:
            say("shutting down processing monitor...")
            say("... shutting down processing monitor complete")
            self._console.bold("done")
        self._console.close()

    def _check_wanted(self) -> None:
        """Ends the coming up between two steps, when nothing is half done."""
        if self._is_unwanted:
            raise KeyboardInterrupt

    def _open_logs(self) -> None:
        for uri in (self._ordered_uri, self.master_uri):
            split_master_uri(uri)  # complains about one that is none
        client = MasterClient(self.master_uri, CALLER_ID, timeout_s=_MASTER_ANSWERS_WITHIN_S)
        running = run_id_of(client)
        client.close()
        self._is_master_there = running is not None
        self.run_id = self._options.run_id or running or new_run_id()
        if self._options.run_id and running and running != self._options.run_id:
            raise LaunchError(
                f"run_id on parameter server does not match declared run_id: {running} vs "
                f"{self._options.run_id}"
            )
        self._logs = LogFolder.of_run(self._environment, self.run_id)
        self._logs.check_writable()
        log = self._logs.file_of_launcher()
        self._console.open_log(log)
        self._log = log
        self._console.say(f"... logging to {log}")
        if self._options.checks_log_folder:
            self._console.say("Checking log directory for disk usage. This may take a while.")
            self._console.say("Press Ctrl-C to interrupt")
            self._console.say(disk_usage_report(self._logs.path.parent))

    def _set_title(self, uri: str = "") -> None:
        names = ["roscore"] if self._options.is_core else self._files
        self._console.title(" ".join([",".join(names), uri]).strip())

    def _load(self) -> None:
        self.launch = self._load_launch() if self._load_launch is not None else self._load_files()
        for warning in self.launch.warnings:
            self._console.error(f"WARNING: {warning}")
        self._tell_details()
        used = {node.machine for node in self.launch.nodes if node.machine}
        self._has_far_nodes = not self._options.run.local_only and not all(
            is_here(self.launch.machines[name]) for name in used
        )

    def _tell_details(self) -> None:
        """What `-v` shows, and the log file keeps, of what was read."""
        detail = self._console.detail
        for file in self.launch.files:
            detail(f"... loading XML file [{file}]")
        for key in self.launch.params:
            detail(f"Added parameter [{key}]")
        for node in self.launch.nodes:
            detail(f"Added node of type [{node.package}/{node.type}] in namespace [{node.namespace}]")
        if self._options.run.local_only:
            self._console.say("local only launch specified, will not launch remote nodes")

    def _load_files(self) -> Launch:
        texts = []
        if STDIN in self._files:
            print("Passed '-' as file argument, attempting to read roslaunch XML from stdin.", flush=True)
            texts.append(sys.stdin.read())
            print(f"... {len(texts[0])} bytes read successfully.\n", flush=True)
        files = [file for file in self._files if file != STDIN]
        launch = load(files, self._arguments, surroundings=Surroundings.here(self._index), texts=texts)
        declared = {argument.name for argument in launch.arguments}
        for name in self._arguments:
            if name not in declared and files:
                self._console.error(f"WARNING: no <arg> named [{name}] is declared in {', '.join(files)}")
        return launch

    def _start_server(self) -> None:
        children: list[str] = []  # other computers are reached by ssh alone
        server = LaunchServer(
            self._environment, self._processes, {"list_children": lambda: [1, "roslaunch children", children]}
        )
        server.start()
        self._server = server
        server.check_address(_MASTER_ANSWERS_WITHIN_S)
        self._console.bold(f"started roslaunch server {server.uri}")
        if self._options.is_core:
            self._console.say(f"ros_comm version {ROS_COMM_VERSION}")

    def _processes(self) -> Sequence[ProcessReport]:
        return self._run.processes() if self._run is not None else ()

    def _start_master(self) -> None:
        if self._is_master_there and self._options.is_core:
            raise LaunchError(
                "roscore cannot run as another roscore/master is already running. \n"
                "Please kill other roscore/master processes before relaunching.\n"
                f"The ROS_MASTER_URI is {self.master_uri}"
            )
        if self._is_master_there:
            self._announce_master()
            return
        host, port = split_master_uri(self._environment.master_uri)
        if self._options.is_core:
            self._warn_about_port(port)
        elif not is_this_computer(host):
            raise LaunchError(
                f"ERROR: unable to contact ROS master at [{self.master_uri}], and [{host}] is not this "
                "computer, so no master can be started there. Is roscore running on it?"
            )
        self._console.say("auto-starting new master")
        core = Core(
            port=port,
            host=self._options.bind,
            run_id=self.run_id,
            log_folder=self._logs.path,
            environment=self._environment,
            allow=self._options.allow,
            store=self._options.store,
            notice_timeout_s=self._options.notice_timeout_s,
            master_logger_level=self._options.master_logger_level,
            on_shutdown=lambda _reason: self.request_stop(),
        )
        try:
            core.start_master()
        except OSError as error:
            raise LaunchError(
                f"cannot start a master on port {port}: {error.strerror or error}. Another program may use "
                "the port; choose another one by -p or ROS_MASTER_URI"
            ) from None
        self._core = core
        self._console.bold(f"process[master]: started with pid [{os.getpid()}]")
        self._announce_master()
        self._console.say(f"master {core.binding}")
        self._console.bold(f"setting /run_id to {self.run_id}")

    def _warn_about_port(self, port: int) -> None:
        _, ordered = split_master_uri(self._ordered_uri)
        if ordered != port:
            self._console.error(
                f"WARNING: ROS_MASTER_URI port [{ordered}] does not match this roscore [{port}]"
            )

    def _say_summary(self) -> None:
        launch = self.launch
        params = {**STANDARD_PARAMETERS, **launch.params}
        machines = launch.machines if self._has_far_nodes else ()
        self._console.say(summary(params, launch.nodes, machines=machines, is_core=self._options.is_core))

    def _warn_about_machines(self) -> None:
        """Says that nodes on other machines will not find a master that only this one can reach."""
        host, _ = split_master_uri(self.master_uri)
        if address.is_loopback(host) and self._has_far_nodes:
            self._console.error(
                f"WARNING: nodes on other machines cannot reach the master at {self.master_uri}; "
                "set ROS_MASTER_URI to a name of this computer that they know"
            )

    def _warn_about_passwords(self) -> None:
        """Says that a password in a launch file logs nobody in."""
        for machine in self.launch.machines.values():
            if machine.password and self._has_far_nodes:
                self._console.error(
                    f"WARNING: the password of machine [{machine.name}] is not used: ssh takes none from a "
                    "launch file. Let it log in by a key (ssh-copy-id) or an agent"
                )

    def _announce_master(self) -> None:
        self._console.bold(f"ROS_MASTER_URI={self.master_uri}")
        self._set_title(self.master_uri)

    def _start_nodes(self) -> None:
        """Starts the nodes, and while they come up `/rosout`; the first process number is its."""
        # Noetic's nodes are told the launcher's log file, too.
        variables = {**os.environ, "ROS_LOG_FILENAME": str(self._log)}
        maker = CommandMaker(self._index, variables, self._environment.ros_home.expanduser().absolute())
        run = Run(
            self.launch,
            maker,
            master_uri=self.master_uri,
            logs=self._logs,
            console=self._console,
            options=self._options.run,
            first_number=1 if self._core is None else 2,
            on_end=self._on_end,
        )
        self._publish_server()
        self._run = run
        if self._is_unwanted:
            run.request_stop()
        run.set_parameters()
        if self._core is not None:
            self._console.bold(f"process[rosout-1]: started with pid [{os.getpid()}]")
            if not self.launch.nodes:
                self._core.start_rosout()
            self._console.say("started core service [/rosout]")
        run.start_nodes()
        if self._core is not None and self.launch.nodes:
            self._core.start_rosout()

    def _publish_server(self) -> None:
        if self._server is None:
            return
        client = MasterClient(self.master_uri, CALLER_ID)
        try:
            client.set_param(self._server.parameter, self._server.uri)
            if self._core is None:
                for key, value in STANDARD_PARAMETERS.items():
                    client.set_param(key, value)
        finally:
            client.close()

    def _forget_server(self, server: LaunchServer) -> None:
        client = MasterClient(self.master_uri, CALLER_ID, timeout_s=1.0)
        try:
            client.delete_param(server.parameter)
        except PiprosError:
            pass  # the master may be gone, or somebody deleted it
        finally:
            client.close()
