"""A launch session's master: one that is already running, or one that the session starts and stops."""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from pipros.basics.env import DEFAULT_MASTER_PORT, Environment, InvalidEnvironment, split_master_uri
from pipros.basics.errors import ProtocolError, Refused, Unreachable
from pipros.master.options import MasterOptions
from pipros.net import address
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import Fault
from pipros.net.this_machine import is_this_machine
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.param_upload import CALLER_ID
from pipros_tools.launch.roscore import Core
from pipros_tools.launch.run_id import is_run_id, new_run_id, run_id_problem

_ANSWER_S = 5.0


class SessionMaster:
    """A session's master. Call `find`, `start` and `stop`, in this order; call `stop` even if `start` fails.

    Attributes:
        environment: the session's environment, including its master's URI.
        sets_run_id: whether `start` sets `/run_id`: True if the session starts the master, or if the master
            does not have a run id.
    """

    def __init__(
        self,
        environment: Environment,
        options: MasterOptions,
        console: Console,
        *,
        is_core: bool,
        port: int | None,
        on_shutdown: Callable[[], None],
    ) -> None:
        """Store the arguments. No master is contacted or started yet.

        Args:
            environment: the process's environment.
            options: options for the master, if the session starts one; `port`, `known_as` and `on_shutdown`
                are overridden.
            is_core: whether it is an error if a master is already running, as for `roscore`.
            port: see `master_environment`.
            on_shutdown: called from another thread when a process on this computer shuts the master down.
        """
        self._requested_uri = environment.master_uri
        self.environment = master_environment(environment, is_core=is_core, port=port, bind=options.host)
        self._console = console
        self._is_core = is_core
        self._is_running = False
        self.sets_run_id = True
        self._options = replace(options, on_shutdown=lambda _reason: on_shutdown())
        self._core: Core | None = None

    @property
    def uri(self) -> str:
        return self.environment.master_uri

    @property
    def is_own(self) -> bool:
        """Whether the session started the master."""
        return self._core is not None

    @property
    def binding(self) -> str:
        """A description of who can connect to the session's own master.

        Empty if the session uses another master.
        """
        return "" if self._core is None else self._core.binding

    def find(self) -> str | None:
        """Return the running master's run id.

        Return an empty string if the master has none, and None if no master answers.

        Raises:
            InvalidEnvironment: ROS_MASTER_URI is not a valid URI for a master.
            LaunchError: the server at that address is not a master.
        """
        for uri in (self._requested_uri, self.uri):
            split_master_uri(uri)
        client = MasterClient(self.uri, CALLER_ID, timeout_s=_ANSWER_S)
        try:
            run_id = run_id_of(client)
        finally:
            client.close()
        self._is_running = run_id is not None
        self.sets_run_id = not run_id
        return run_id

    def start(self, run_id: str, log_folder: Path) -> None:
        """Start a master unless `find` has found one. If the existing master has no run id, set `run_id`.

        Raises:
            LaunchError: a master is already running but a core was requested; ROS_MASTER_URI refers to
                another computer; or the port is in use.
            Unreachable: the master found earlier no longer answers.
        """
        if self._is_running:
            if self._is_core:
                raise LaunchError(
                    "roscore cannot run as another roscore/master is already running. \n"
                    "Please kill other roscore/master processes before relaunching.\n"
                    f"The ROS_MASTER_URI is {self.uri}"
                )
            if self.sets_run_id:
                self._set_run_id(run_id)
            return
        host, port = split_master_uri(self.uri)
        if self._is_core:
            self._warn_about_port(port)
        elif not is_this_machine(host):
            raise LaunchError(
                f"ERROR: unable to contact ROS master at [{self.uri}], and [{host}] is not this "
                "computer, so no master can be started there. Is roscore running on it?"
            )
        self._console.say("auto-starting new master")
        core = Core(
            self._options,
            run_id=run_id,
            log_folder=log_folder,
            environment=self.environment,
            port=port,
            known_as=split_master_uri(self._requested_uri)[:1],
        )
        try:
            core.start_master()
        except OSError as error:
            reason = error.strerror or str(error)
            bind = self._options.host
            if bind and (isinstance(error, socket.gaierror) or error.errno == errno.EADDRNOTAVAIL):
                raise LaunchError(
                    f"cannot start a master at [{bind}]: {reason}. --bind must be an address of "
                    "this computer, or 0.0.0.0 for all of them"
                ) from None
            raise LaunchError(
                f"cannot start a master on port {port}: {reason}. Another program may use the port; choose "
                "another one with -p or ROS_MASTER_URI"
            ) from None
        except ValueError as error:
            raise LaunchError(f"cannot start a master: {error}") from None
        self._core = core
        self._console.bold(f"process[master]: started with pid [{os.getpid()}]")

    def start_rosout(self) -> None:
        """Start the `/rosout` node of the session's own master."""
        if self._core is not None:
            self._core.start_rosout()

    def stop_rosout(self) -> None:
        """Stop the `/rosout` node of the session's own master, and announce that the master is shutting down.

        Do nothing if the session uses another master.
        """
        if self._core is not None:
            self._console.say("[rosout-1] killing on exit")
            self._core.stop_rosout()
            self._console.say("[master] killing on exit")

    def stop(self) -> None:
        """Stop the session's own master. Do nothing if it was not started."""
        if self._core is not None:
            self._core.stop()

    def _set_run_id(self, run_id: str) -> None:
        client = MasterClient(self.uri, CALLER_ID, timeout_s=_ANSWER_S)
        try:
            client.set_param("/run_id", run_id)
        finally:
            client.close()

    def _warn_about_port(self, port: int) -> None:
        _, requested = split_master_uri(self._requested_uri)
        if requested != port:
            self._console.error(
                f"WARNING: ROS_MASTER_URI port [{requested}] does not match this roscore [{port}]"
            )


def choose_run_id(requested: str | None, running: str | None, console: Console) -> str:
    """Return the id of the run that a launch joins: the requested id, the running master's id, or a new id.

    If the master's id is not a valid folder name, a warning is printed and the id is ignored.

    Args:
        requested: value of `--run_id`.
        running: result of `SessionMaster.find`.

    Raises:
        LaunchError: the requested id is not a valid folder name, or differs from the master's.
    """
    if requested and not is_run_id(requested):
        raise LaunchError(run_id_problem(requested, "--run_id"))
    if running and not is_run_id(running):
        problem = run_id_problem(running, "/run_id on the parameter server")
        running = ""
        console.error(f"WARNING: {problem}. The log files of this run use a new id")
    if requested and running and running != requested:
        raise LaunchError(
            f"run_id on parameter server does not match declared run_id: {running} vs {requested}"
        )
    return requested or running or new_run_id()


def master_environment(
    environment: Environment, *, is_core: bool, port: int | None, bind: str | None
) -> Environment:
    """Return the environment with the URI of the session's master.

    As in Noetic, `roscore` ignores the port in `ROS_MASTER_URI`. By default, it advertises loopback. If the
    host in `ROS_MASTER_URI` is a name of this computer other than localhost, `roscore` advertises this
    computer's name, and accepts connections from other machines. `ROS_HOSTNAME` and `ROS_IP` take precedence.

    Args:
        is_core: whether this is a `roscore` session.
        port: the master's port; defaults to 11311 for `roscore`, otherwise to the port in `ROS_MASTER_URI`.
        bind: address that `roscore` listens on; by default derived from the environment.
    """
    if is_core:
        port = port or DEFAULT_MASTER_PORT
        if bind in (address.ANY, address.ANY_IPV6):
            # As in Noetic, a master that listens on all addresses advertises this computer's name.
            host = environment.hostname or environment.ip or socket.gethostname()
        elif bind is not None:
            host = bind
        else:
            host = address.advertised_host(environment._replace(master_uri=_uri_here(environment, port)))
        return environment._replace(master_uri=address.uri(host, port))
    if port is not None:
        host, _ = split_master_uri(environment.master_uri)
        return environment._replace(master_uri=f"http://{address.host_and_port(host, port)}")
    return environment


def _uri_here(environment: Environment, port: int) -> str:
    """Return the URI that determines the address on which a core listens.

    Its host is the host in `ROS_MASTER_URI` if that is this computer and neither ROS_HOSTNAME nor ROS_IP is
    set, otherwise `localhost`.
    """
    try:
        host, _ = split_master_uri(environment.master_uri)
    except InvalidEnvironment:
        host = "localhost"
    if environment.hostname or environment.ip or not is_this_machine(host):
        host = "localhost"
    return address.uri(host, port)


def run_id_of(client: MasterClient) -> str | None:
    """Return the master's run id, an empty string if it has none, or None if no master responds.

    Raises:
        LaunchError: the server at that address is not a master.
    """
    try:
        return str(client.get_param("/run_id"))
    except Refused:
        return ""
    except Unreachable:
        return None
    except (ProtocolError, Fault) as error:
        raise LaunchError(
            f"the server at ROS_MASTER_URI [{client.uri}] is not a ROS master: {error}. "
            "Choose another port with -p or ROS_MASTER_URI"
        ) from None
