"""A ROS system for a test: a master's address, a home folder, and programs of pipros or of genuine ROS."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xmlrpc.client import ServerProxy

from pipros.basics.env import Environment
from pipros_tools.launch.roscore import Core
from tests.support.answers import interpreter, script_of
from tests.support.environments import genuine_environment, pipros_environment
from tests.support.processes import Process, Processes
from tests.support.terminal import BASH, Terminal
from tests.support.waiting import wait_until

if TYPE_CHECKING:
    from pipros.node import Node

_ASK_EVERY_S = 0.05
"""How often a master is asked what is registered: each time, it and this process compute for 0.5 ms."""

_FORGETFUL = {"rospack", "rosstack"}
"""Genuine programs that test whether they are quiet before they have set it, when words on the command line
are too many: about one run in four ends without its error message, by what the memory held before."""
_RUNS = 30

_FOUND: dict[tuple[str | None, ...], str] = {}
"""The files that genuine `rosrun` found, by the two path variables, the package and the name."""


class Side:
    """Starts programs of one implementation in a `RosSystem`: `side.start("rosrun", "pkg", "node.py")`."""

    forks = False
    """Whether `run` forks an interpreter for the commands of ROS."""

    def __init__(self, environment: Mapping[str, str], cwd: Path, *, is_genuine: bool = False) -> None:
        self.home = cwd
        self.is_genuine = is_genuine
        self.processes = Processes(environment, cwd)
        self._terminals: list[Terminal] = []

    @property
    def environment(self) -> dict[str, str]:
        return self.processes.environment

    def start(self, *argv: str | Path, **more: str) -> Process:
        """Start a program. `more` are environment variables, merged into those of this side."""
        return self.processes.start(*argv, environment=more)

    def run(
        self, *argv: str | Path, cwd: Path | None = None, timeout_s: float = 60.0, **more: str
    ) -> Process:
        """Run a program to its end. If this side forks, a script runs in a fork: see `answers`.

        Such a program has no process group of its own.
        """
        words, environment = [str(word) for word in argv], {**self.environment, **more}
        if self.forks and (script := script_of(words, environment["PATH"])):
            return interpreter(self.is_genuine).answer(script, cwd or self.home, environment, timeout_s)
        is_forgetful = self.is_genuine and words[0] in _FORGETFUL and "-q" not in words
        for _ in range(_RUNS if is_forgetful else 1):
            ended = self.processes.run(*words, cwd=cwd, timeout_s=timeout_s, environment=more)
            if not ended.returncode or ended.lines:
                break
        return ended

    def node(self, package: str, program: str) -> list[str]:
        """Return a command line that runs a node like `rosrun`.

        To find the file, genuine `rosrun` uses more processor time than many nodes use to start. Therefore,
        the file is looked up once, and the command line is its path.
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
        """Start `roscore` on this system's port, and wait until it is ready."""
        core = self.start("roscore", "-p", self.environment["ROS_MASTER_URI"].rpartition(":")[2])
        core.wait_for(r"started core service \[/rosout\]")
        return core

    def start_bare_master(self) -> Process:
        """Start a master with the parameters that `roscore` sets, but without /rosout.

        Genuine roscore would take four times the processor time, because it starts two more processes.
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
        port, master_uri: the address for a master. No master runs until a method starts one.
        home: the working directory of the programs, initially empty. `ROS_HOME` is its subfolder `.ros`.
        pipros, genuine: the sides that start programs of pipros and of genuine ROS.
    """

    def __init__(self, port: int, home: Path, tools: Path) -> None:
        self.port = port
        self.master_uri = f"http://127.0.0.1:{port}"
        self.home = home
        self.pipros = Side(pipros_environment(home, self.master_uri, tools), home)
        self._core: Core | None = None
        self.genuine = Side(genuine_environment(home, self.master_uri), home, is_genuine=True)

    def serve_master(self) -> None:
        """Run a master of pipros in this process, without /rosout, for tests that can use any master.

        This takes a tenth of the processor time of a separate process.
        """
        environment = Environment(master_uri=self.master_uri, ros_home=self.home / ".ros")
        self._core = Core(run_id="a-test", environment=environment, port=self.port)
        self._core.start_master()

    def node(self, name: str) -> Node:
        """Return a node in this process, which a `with` block starts."""
        from pipros.node import Node

        return Node(name, environment=Environment(master_uri=self.master_uri))

    def publishers(self, topic: str) -> list[str]:
        """Return the registered publishers of a topic; an empty list if no master answers."""
        return self._registered(0).get(topic, [])

    def subscribers(self, topic: str) -> list[str]:
        """Return the registered subscribers of a topic; an empty list if no master answers."""
        return self._registered(1).get(topic, [])

    def wait_for_publisher(self, topic: str, timeout_s: float = 60.0) -> None:
        """Wait until the topic has a registered publisher."""
        self._wait(lambda: self.publishers(topic), timeout_s, f"a publisher of {topic}")

    def wait_for_subscriber(self, topic: str, timeout_s: float = 60.0) -> None:
        """Wait until the topic has a registered subscriber."""
        self._wait(lambda: self.subscribers(topic), timeout_s, f"a subscriber of {topic}")

    def wait_for_links(self, topic: str, count: int = 1, timeout_s: float = 60.0) -> None:
        """Wait until the publishers of the topic have at least `count` links to subscribers."""
        self._wait(lambda: self._links(topic) >= count, timeout_s, f"{count} links of {topic}")

    def _wait(self, condition: Callable[[], object], timeout_s: float, what: str) -> None:
        wait_until(condition, timeout_s, what, _ASK_EVERY_S)

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


class Commands:
    """Starts commands of pipros in a system, on a master in the test's process.

    Attributes:
        home: the working directory of the commands.
    """

    def __init__(self, ros: RosSystem, master_uri: str) -> None:
        self.home = ros.home
        self._ros = ros
        self._master_uri = master_uri

    def start(self, *argv: str | Path) -> Process:
        return self._ros.pipros.start(*argv, ROS_MASTER_URI=self._master_uri)

    def run(self, *argv: str | Path) -> Process:
        return self._ros.pipros.run(*argv, ROS_MASTER_URI=self._master_uri)
