"""One ROS system of a test: a port for its master, a home, and programs of pipros or of genuine ROS in it."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.basics.env import Environment
from pipros.launch.roscore import Core
from tests.support.environments import genuine_environment, pipros_environment
from tests.support.processes import Process, Processes
from tests.support.terminal import BASH, Terminal
from tests.support.waiting import wait_until

_FOUND: dict[tuple[str | None, ...], str] = {}
"""The files that genuine `rosrun` found."""


class Side:
    """The programs of one implementation in a RosSystem: `side.start("rosrun", "pkg", "node.py")`."""

    def __init__(self, environment: Mapping[str, str], cwd: Path, *, is_genuine: bool = False) -> None:
        self.home = cwd
        self.is_genuine = is_genuine
        self.processes = Processes(environment, cwd)
        self._terminals: list[Terminal] = []

    @property
    def environment(self) -> dict[str, str]:
        return self.processes.environment

    def start(self, *argv: str | Path, **more: str) -> Process:
        """Start a program; keywords are environment variables merged into those of this side."""
        return self.processes.start(*argv, environment=more)

    def run(self, *argv: str | Path, timeout_s: float = 60.0, **more: str) -> Process:
        """Run a program to its end."""
        return self.processes.run(*argv, timeout_s=timeout_s, environment=more)

    def node(self, package: str, program: str) -> list[str]:
        """Return the command line of a node for `rosrun`.

        Genuine `rosrun` uses more processor time to find the file than many nodes to start. So the file is
        looked up once, and the node is started directly.
        """
        if not self.is_genuine:
            return ["rosrun", package, program]
        place = self.environment.get("ROS_PACKAGE_PATH"), self.environment.get("CMAKE_PREFIX_PATH")
        key = (*place, package, program)
        if key not in _FOUND:
            ended = self.run("rosrun", "--prefix", "echo", package, program)
            assert ended.returncode == 0, ended.output
            _FOUND[key] = ended.stdout[-1]
        return [_FOUND[key]]

    def start_node(self, package: str, program: str, *arguments: str, **more: str) -> Process:
        """Start a node of a package; see `node`."""
        return self.start(*self.node(package, program), *arguments, **more)

    def open_terminal(self, shell: Sequence[str] = BASH) -> Terminal:
        """Open a terminal with a shell in the environment of this side."""
        terminal = Terminal(self.environment, self.home, shell)
        self._terminals.append(terminal)
        return terminal

    def start_master(self) -> Process:
        """Start `roscore` on this system's port (its default would be 11311), and wait until it is ready."""
        core = self.start("roscore", "-p", self.environment["ROS_MASTER_URI"].rpartition(":")[2])
        core.wait_for(r"started core service \[/rosout\]")
        return core

    def start_bare_master(self) -> Process:
        """Start a master with the parameters of `roscore`, without /rosout, for tests that do not need it.

        Genuine roscore takes four times the processor time, for two processes more.
        """
        uri = self.environment["ROS_MASTER_URI"]
        process = self.start("rosmaster", "--core", "-p", uri.rpartition(":")[2])
        parameters = {"/rosdistro": "noetic\n", "/rosversion": "1.16.0\n", "/run_id": "a-test"}
        master: Any = ServerProxy(uri)

        def takes_parameters() -> bool:
            try:
                return all(master.setParam("/a_test", key, parameters[key])[0] == 1 for key in parameters)
            except OSError:
                assert process.is_running, process.output
                return False

        wait_until(takes_parameters, 60, "a master")
        master("close")()
        return process

    def close(self) -> None:
        """End all running programs, and check that none is still running."""
        for terminal in reversed(self._terminals):
            terminal.close()
        self.processes.end_all()


class RosSystem:
    """A master's address, a home folder, and both implementations.

    Attributes:
        port, master_uri: where the master of this system is to be. None runs until one is started.
        home: an empty folder; `ROS_HOME` is `.ros` in it, and programs run with it as working folder.
        pipros, genuine: the two sides.
    """

    def __init__(self, port: int, home: Path, tools: Path) -> None:
        self.port = port
        self.master_uri = f"http://127.0.0.1:{port}"
        self.home = home
        self.pipros = Side(pipros_environment(home, self.master_uri, tools), home)
        self._core: Core | None = None
        self.genuine = Side(genuine_environment(home, self.master_uri), home, is_genuine=True)

    def serve_master(self) -> None:
        """Serve a master of pipros from this process, without /rosout, for tests that need any master.

        It takes a tenth of the processor time of a process with one.
        """
        environment = Environment(master_uri=self.master_uri, ros_home=self.home / ".ros")
        self._core = Core(run_id="a-test", environment=environment, port=self.port)
        self._core.start_master()

    def publishers(self, topic: str) -> list[str]:
        """Return the publishers of the topic registered at the master; empty while no master answers."""
        return self._registered(0).get(topic, [])

    def subscribers(self, topic: str) -> list[str]:
        """Return the subscribers of the topic registered at the master; empty while no master answers."""
        return self._registered(1).get(topic, [])

    def wait_for_publisher(self, topic: str, timeout_s: float = 60.0) -> None:
        """Wait until the topic has a publisher at the master."""
        wait_until(lambda: self.publishers(topic), timeout_s, f"a publisher of {topic}")

    def wait_for_subscriber(self, topic: str, timeout_s: float = 60.0) -> None:
        """Wait until the topic has a subscriber at the master."""
        wait_until(lambda: self.subscribers(topic), timeout_s, f"a subscriber of {topic}")

    def wait_for_links(self, topic: str, count: int = 1, timeout_s: float = 60.0) -> None:
        """Wait until the publishers of the topic send to this number of subscribers."""
        wait_until(lambda: self._links(topic) >= count, timeout_s, f"{count} links of {topic}")

    def _links(self, topic: str) -> int:
        rows: list[Any] = []
        with ServerProxy(self.master_uri) as opened:
            master: Any = opened
            for node in self.publishers(topic):
                with contextlib.suppress(OSError), ServerProxy(master.lookupNode("/a_test", node)[2]) as api:
                    answer: Any = api.getBusInfo("/a_test")
                    rows += answer[2]
        return len([row for row in rows if row[2] == "o" and row[4] == topic])

    def _registered(self, kind: int) -> dict[str, list[str]]:
        master: Any = ServerProxy(self.master_uri)
        try:
            return dict(master.getSystemState("/a_test")[2][kind])
        except OSError:
            return {}
        finally:
            master("close")()

    def close(self) -> None:
        """End all programs of both sides, and check that none is still running."""
        try:
            self.genuine.close()
        finally:
            try:
                self.pipros.close()
            finally:
                if self._core is not None:
                    self._core.stop()
