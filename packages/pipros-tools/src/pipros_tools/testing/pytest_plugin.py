"""pipros's pytest plugin: fixtures that provide a ROS system, and the collection of launch files with tests.

Every pytest run in the environment loads this plugin (entry point `pipros`, disabled by `-p no:pipros`), so
it imports other pipros modules only when they are needed: to collect a launch file with tests, by a test,
or to write a JUnit file.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import pytest

if TYPE_CHECKING:
    from pipros.node import Node
    from pipros_tools.launch.roscore import Core
    from pipros_tools.testing.faults.history import History
    from pipros_tools.testing.faults.ros_proxy import FaultProxy
    from pipros_tools.testing.launch_fixture import Launched
    from pipros_tools.testing.pytest_programs import TestPrograms

T = TypeVar("T")

_POLL_INTERVAL_S = 0.02

_PROGRAMS: pytest.StashKey[TestPrograms | None] = pytest.StashKey()


class WaitUntil(Protocol):
    """The type of `ros_wait_until`."""

    def __call__(self, condition: Callable[[], T], timeout_s: float = 10.0, what: str = "") -> T: ...


class LaunchFile(Protocol):
    """The type of `ros_launch`."""

    def __call__(self, *words: str | Path, **arguments: Any) -> Launched: ...


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("pipros", "launch files with tests")
    group.addoption(
        "--ros-fault-seed",
        metavar="NUMBER",
        type=int,
        default=0,
        help="seed for the faults of ros_faults; the same seed gives the same faults at the same bytes",
    )
    group.addoption(
        "--ros-arg",
        metavar="NAME:=VALUE",
        action="append",
        default=[],
        help="argument for launch files with tests, as on rostest's command line; may be repeated",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect `.test` files that are launch files, and `.launch` files with tests."""
    from pipros_tools.testing.pytest_programs import has_tests

    if not has_tests(file_path):
        return None
    from pipros_tools.testing.pytest_items import LaunchFileCollector

    return LaunchFileCollector.from_parent(parent, path=file_path)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the folders `devel` and `install` of a workspace, unless the command line names a path there.

    Their programs run those in `src`.
    """
    if not (collection_path / ".catkin").is_file():
        return None
    named = (Path(config.invocation_params.dir, word.partition("::")[0]) for word in config.args)
    return None if any(path.is_relative_to(collection_path) for path in named) else True


def pytest_configure() -> None:
    """Limit waits for a master in this process, but not in programs that it starts.

    See `pipros.node.missing_master`.
    """
    os.environ["PIPROS_PYTEST"] = str(os.getpid())


def pytest_unconfigure() -> None:
    os.environ.pop("PIPROS_PYTEST", None)


@pytest.hookimpl(tryfirst=True)
def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Leave out a program that a collected launch file runs as `<test>`."""
    if not any((folder / "package.xml").is_file() for folder in module_path.parents):
        return None
    from pipros_tools.testing.pytest_programs import LeftOutFile, TestPrograms

    programs = parent.config.stash.setdefault(_PROGRAMS, None) or TestPrograms(parent.config)
    parent.config.stash[_PROGRAMS] = programs
    return LeftOutFile.from_parent(parent, path=module_path) if programs.leaves_out(module_path) else None


def pytest_report_collectionfinish(config: pytest.Config) -> list[str]:
    """List the programs that were left out."""
    programs = config.stash.get(_PROGRAMS, None)
    return [] if programs is None else programs.report()


@pytest.hookimpl(wrapper=True)
def pytest_sessionfinish(session: pytest.Session) -> Iterator[None]:
    """Write the cases of launch files into the JUnit file that pytest has written."""
    yield
    named = session.config.getoption("xmlpath", None)
    if not named or hasattr(session.config, "workerinput"):
        return
    from pipros.basics.input_file import read_text
    from pipros.basics.replaced_file import write_whole
    from pipros_tools.testing.junit_cases import PROPERTY, with_cases

    file = Path(named).expanduser()
    text = read_text(file) if file.is_file() else ""
    if PROPERTY in text:
        write_whole(file, with_cases(text).encode())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Register the fixtures that plugins offer, before the first test that uses an undefined fixture."""
    defined = getattr(getattr(item, "_fixtureinfo", None), "name2fixturedefs", {})
    if not set(getattr(item, "fixturenames", ())) <= {"request", *defined}:
        from pipros.basics.plugins import all_offered

        for module in all_offered("pytest"):
            if not item.config.pluginmanager.is_registered(module):
                item.config.pluginmanager.register(module)


@pytest.fixture
def ros_master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Core]:
    """A master for the test, in this process and on a free port.

    `ROS_MASTER_URI` is set to its address, `ros_master.uri`. Tests that run in parallel have separate
    masters.
    """
    from pipros.basics.env import DEFAULT_MASTER_URI, Environment
    from pipros_tools.launch.roscore import Core

    # The new master is on this computer, even if ROS_MASTER_URI refers to another one.
    monkeypatch.setenv("ROS_MASTER_URI", DEFAULT_MASTER_URI)
    with Core(port=0, rosout=False, environment=Environment.from_os()) as core:
        monkeypatch.setenv("ROS_MASTER_URI", core.uri)
        yield core


@pytest.fixture
def ros_node(ros_master: Core) -> Iterator[Node]:
    """A node `/pytest` on the test's master, in this process. It is shut down after the test."""

    from pipros.basics.env import Environment
    from pipros.node import Node

    environment = Environment.from_os()._replace(master_uri=ros_master.uri)
    with Node("pytest", environment=environment) as node:
        yield node


@pytest.fixture
def ros_launch(ros_master: Core, request: pytest.FixtureRequest) -> Iterator[LaunchFile]:
    """Start the nodes of a launch file on the test's master: `ros_launch("pkg", "file.launch", level=25)`.

    A single positional argument is a file path, relative to the test module's folder. Keyword arguments are
    passed to the launch file as `<arg>` values. `<test>` elements in the file are ignored. After the test,
    the nodes are stopped, those of the last call first. If the `ros_faults` fixture is used, the nodes
    communicate with all other nodes through its proxy.
    """
    from pipros_tools.testing.launch_fixture import Launched

    launched: list[Launched] = []
    master_uri = ros_master.uri
    if "ros_faults" in request.fixturenames:
        master_uri = request.getfixturevalue("ros_faults").uri

    def launch(*words: str | Path, **arguments: Any) -> Launched:
        nodes = Launched(words, arguments, master_uri, folder=request.path.parent)
        launched.append(nodes)
        nodes.start()
        return nodes

    try:
        yield launch
    finally:
        for nodes in reversed(launched):
            nodes.stop()


@pytest.fixture
def ros_faults(
    ros_master: Core, monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config
) -> Iterator[FaultProxy]:
    """A proxy between the nodes started by the test and all other nodes, to disturb their connections.

    `ROS_MASTER_URI` is set to the proxy's address, so nodes started by `ros_launch` are behind the proxy, but
    `ros_node` is not. The proxy does not disturb connections until
    `ros_faults.inject("topics", delay_s=0.05)`, `.cut()`, `.stall()` or `.refuse()` is called.
    """
    from pipros_tools.testing.faults.ros_proxy import FaultProxy

    with FaultProxy(ros_master.uri, seed=pytestconfig.getoption("--ros-fault-seed")) as proxy:
        monkeypatch.setenv("ROS_MASTER_URI", proxy.uri)
        yield proxy


@pytest.fixture
def ros_history() -> History:
    """A history that numbers messages and checks for duplicates, reordering, corruption and loss.

    A publisher sends `ros_history.next_text("talker")`, subscribers pass received texts to
    `ros_history.receive(text)`, and `ros_history.problems()` lists the duplicated, reordered, corrupted and
    lost messages.
    """
    from pipros_tools.testing.faults.history import History

    return History()


@pytest.fixture
def ros_wait_until() -> WaitUntil:
    """Wait for a condition: `ros_wait_until(lambda: received, what="a message")`.

    Return the first true value. Fail the test if there is none within `timeout_s`.
    """

    def wait_until(condition: Callable[[], T], timeout_s: float = 10.0, what: str = "") -> T:
        __tracebackhide__ = True
        deadline = time.monotonic() + timeout_s
        while not (value := condition()):
            if time.monotonic() >= deadline:
                pytest.fail(f"waited {timeout_s:g} s for {what or 'a true value'}")
            time.sleep(_POLL_INTERVAL_S)
        return value

    return wait_until
