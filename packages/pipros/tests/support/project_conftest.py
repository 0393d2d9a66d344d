"""Fixtures for all tests, and the treatment of tests that need genuine ROS."""

from __future__ import annotations

import gc
import os
import shutil
import signal
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.support import (
    absent_rooms,
    bridge_clients,
    browser,
    dds_peers,
    lacks,
    long_tests,
    npm,
    outcomes,
    pyright,
    quick,
    ros2_wheels,
    windows,
)
from tests.support.environments import make_tool_folder
from tests.support.examples import examples
from tests.support.genuine import INSTALL, is_required, missing_packages
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.ros import RosSystem
from tests.support.started import STARTED

# On a busy machine, the duration of an example says nothing about the code. CI, which judges one change,
# tries the same examples in each run; elsewhere each run looks for new ones.
settings.register_profile(
    "pipros",
    deadline=None,
    max_examples=examples(100),
    suppress_health_check=[HealthCheck.too_slow],
    derandomize="CI" in os.environ,
)
settings.load_profile("pipros")

SETTINGS = ("ROS_", "ROSCONSOLE_", "PIPROS_ADVERTISE", "PIPROS_LIMITS", "PIPROS_PORTS")
_PACKAGES = Path(__file__).parent
_GENUINE_ROS2 = ("test_gateway_with_genuine_ros2.py", "test_one_environment.py")


def pytest_addoption(parser: pytest.Parser) -> None:
    outcomes.add_options(parser)
    quick.add_options(parser)
    long_tests.add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    gc.disable()  # until all tests are collected: nothing is freed before that, and each worker does it
    outcomes.configure(config)
    lacks.configure(config)
    # SIGINT is ignored in a script's background jobs, and programs started by tests would inherit that.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if is_required() and (missing := missing_packages()):
        raise pytest.UsageError(
            f"genuine ROS 1 is needed here (CI is set) and lacks: {' '.join(missing)}. As root: {INSTALL}"
        )


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    if quick.leaves_out(config, collection_path):
        return True
    if not collection_path.is_relative_to(_PACKAGES):
        return None
    file = collection_path.name
    # PACKAGE/tests/FOLDER/…
    folder = [*collection_path.relative_to(_PACKAGES).parts, "", "", ""][2]
    is_left_out = (folder == "interop" and missing_packages()) or (
        folder == "browser" and not is_required() and browser.missing()
    )
    is_left_out = is_left_out or (
        file == "test_rosbridge_clients.py"
        and not is_required()
        and (bridge_clients.missing() or browser.missing() or missing_packages())
    )
    is_left_out = is_left_out or (
        file == "test_foxglove_client.py" and not is_required() and bridge_clients.missing_foxglove()
    )
    is_left_out = is_left_out or (folder == "dds" and not is_required() and dds_peers.missing())
    is_left_out = is_left_out or (file in _GENUINE_ROS2 and not is_required() and ros2_wheels.missing())
    is_left_out = is_left_out or (
        folder == "windows" and not is_required() and (windows.missing() or missing_packages())
    )
    if absent_rooms.is_needed_by(collection_path):
        return True
    has_npm = is_required() or npm.is_installed()
    return True if is_left_out or (folder == "pyodide" and not has_npm) else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    long_tests.leave_out(config, items)  # before others, because it counts the cases of a test
    outcomes.leave_out(config, items)
    gc.enable()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    STARTED.begin_test()
    lacks.skip_if_missing(item)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the output of every program of the test to the report of a failure.

    In continuous integration, a skipped test counts as a failure, because it proves nothing. This does not
    apply to tests of what a simulated system lacks, because they also run without the simulation.
    """
    report = yield
    if report.failed:
        report.sections += STARTED.sections()
    is_judged = is_required() and not lacks.is_simulated()
    if report.skipped and is_judged and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped, which nothing may be in continuous integration: {report.longrepr}"
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if os.name == "nt":
        return  # what is missing there cannot be installed
    lines = []
    if pyright.find_pyright() is None:
        lines += [
            "tests/typing: what pyright says is not tested, for it is not on this machine",
            f"to have it where Node.js is: {pyright.INSTALL}",
        ]
    if lacking := browser.missing():
        lines += [
            f"tests/browser: the page is not tried in a browser, for this machine lacks: {' '.join(lacking)}",
            f"to have it on Debian 12, as root: {browser.INSTALL}",
        ]
    if not npm.is_installed():
        lines += ["tests/pyodide: Python in a browser is not tried, for this machine lacks npm"]
    if lacking := [*bridge_clients.missing(), *bridge_clients.missing_foxglove()]:
        lines += [
            f"tests/clients: some clients of bridges are not tried; this machine lacks: {', '.join(lacking)}",
            f"to have them where Node.js is: {bridge_clients.INSTALL}",
        ]
    if lacking := dds_peers.missing():
        lines += [
            f"tests/dds: Fast DDS and Cyclone DDS are not tried; this machine lacks: {' '.join(lacking)}",
            f"to have them on Debian 12, as root: {dds_peers.INSTALL}",
        ]
    if lacking := ros2_wheels.missing():
        lines += [
            f"tests/interop: genuine ROS 2 is not tried; this machine lacks: {', '.join(lacking)}",
            f"to have it on Linux with x86_64: {ros2_wheels.INSTALL}",
        ]
    if lacking := windows.missing():
        lines += [
            f"tests/windows: Windows's Python is not tried; this machine lacks: {' '.join(lacking)}",
            f"to have it on Debian 12, as root: {windows.INSTALL}",
        ]
    if shutil.which("systemd-analyze") is None:
        lines += [
            "examples/fleet: the systemd units are not verified; this machine lacks systemd-analyze",
            "to have it on Debian 12, as root: apt-get install --no-install-recommends systemd",
        ]
    if missing := missing_packages():
        lines += [
            "tests/interop: genuine ROS 1 is not complete on this machine",
            f"lacking: {' '.join(missing)}",
            f"to have it on Debian 12, as root: {INSTALL}",
        ]
    if lines:
        terminalreporter.section("left out")
    for line in lines:
        terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def bare_tools(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A PATH folder with a shell's usual tools and no ROS command."""
    return make_tool_folder(tmp_path_factory.mktemp("bare") / "bin")


@pytest.fixture(autouse=True)
def isolated_ros_variables(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Hide the ROS settings, the master and the ~/.ros of the user from all tests."""
    for name in [name for name in os.environ if name.startswith(SETTINGS)]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("ROS_HOME", str(tmp_path_factory.getbasetemp() / "ros_home"))
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")


@pytest.fixture
def claimed_port() -> Iterator[ClaimedPort]:
    """A free port that no other test uses, for tests that must know it in advance; other tests use port 0."""
    port = ClaimedPort()
    yield port
    port.release()


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    """Start programs in the environment of this process; end them, and fail if one is still running."""
    # As usual, programs cache compiled modules for the next start.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    started = Processes(environment, tmp_path)
    yield started
    started.end_all()


@pytest.fixture
def ros(claimed_port: ClaimedPort, tmp_path: Path, bare_tools: Path) -> Iterator[RosSystem]:
    """A private ROS system: free master port, empty home, pipros and genuine programs."""
    system = RosSystem(claimed_port.number, tmp_path, bare_tools)
    yield system
    system.close()
