"""Launch children on other machines, started by ssh."""

from __future__ import annotations

import shlex
import subprocess
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.ssh import ssh_command
from roslaunch.core import Machine, printerrlog, printlog
from roslaunch.nodeprocess import DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM
from roslaunch.pmon import FatalProcessLaunch
from roslaunch.server import ChildROSLaunchProcess

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "TIMEOUT_SSH_CONNECT",
    "SSHChildROSLaunchProcess",
    "printerrlog",
    "printlog",
]

_star_names(__name__, "logging os rosgraph roslaunch xmlrpc.client:ServerProxy socket traceback")

TIMEOUT_SSH_CONNECT = 30.0


class SSHChildROSLaunchProcess(ChildROSLaunchProcess):
    """`roslaunch --child` on another machine, which starts nodes at its parent's request.

    A `ROSLaunchParent` does not use it: it starts each node on another machine by ssh directly.
    """

    def __init__(
        self,
        run_id: str,
        name: str,
        server_uri: str,
        machine: Machine,
        master_uri: str | None = None,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        words = [
            *shlex.split(machine.env_loader or ""),
            "env",
            f"ROS_MASTER_URI={master_uri or Environment.from_os().master_uri}",
            "roslaunch",
            *("-c", name, "-u", server_uri, "--run_id", run_id),
            *("--sigint-timeout", str(sigint_timeout), "--sigterm-timeout", str(sigterm_timeout)),
        ]
        super().__init__(name, words, {})
        self.machine = machine
        self.run_id = run_id
        self.master_uri = master_uri
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        self.started = False
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> bool:
        """Connect and start the child on the other machine.

        Raises:
            FatalProcessLaunch: there is no ssh client.
        """
        super().start()
        command = ssh_command(self.machine.to_model(), self.args)
        printlog(f"remote[{self.name}] starting roslaunch")
        try:
            self._process = subprocess.Popen(  # noqa: S603
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
            )
        except OSError as error:
            raise FatalProcessLaunch(f"cannot run ssh: {error.strerror}") from error
        self.started = True
        return True

    def getapi(self) -> Any:
        """Return a proxy of the child's server; None until the child has registered."""
        return None if self.uri is None else ServerProxy(self.uri)

    def is_alive(self) -> bool:
        process = self._process
        if process is not None and process.poll() is None:
            return True
        if process is not None:
            self.exit_code = process.returncode
        return super().is_alive() if self.started else False

    def stop(self, errors: list[str] | None = None) -> None:
        """Request the child to exit, and close the connection, which ends it in any case."""
        process, child = self._process, self.getapi()
        if process is None or process.poll() is not None:
            return
        try:
            if child is not None:
                child.shutdown()
                process.wait(self.sigint_timeout)
        except (OSError, subprocess.TimeoutExpired) as error:
            if errors is not None:
                errors.append(f"remote[{self.name}]: {error}")
        process.terminate()
        try:
            process.wait(self.sigterm_timeout)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
