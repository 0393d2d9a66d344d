"""Fixtures for all tests, and the treatment of tests that need genuine ROS."""

import gc
import os
import signal
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from tests.support import absent_plugins, lacks, left_out, long_tests, outcomes, quick
from tests.support.constants import Constants, changed
from tests.support.environments import REPOSITORY, make_tool_folder
from tests.support.examples import examples
from tests.support.genuine import is_required
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.ros import RosSystem
from tests.support.started import STARTED

if hasattr(signal, "SIGHUP"):  # which `nohup` lets all programs ignore
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# On a busy machine, the duration of an example says nothing about the code. CI, which judges one change,
# tries the same examples in each run; elsewhere each run looks for new ones.
settings.register_profile(
    "pipros", deadline=None, max_examples=examples(100), suppress_health_check=[HealthCheck.too_slow],
    derandomize="CI" in os.environ,
)  # fmt: skip
settings.load_profile("pipros")

SETTINGS = ("ROS_", "ROSCONSOLE_", "PIPROS_ADVERTISE", "PIPROS_LIMITS", "PIPROS_PORTS")


def pytest_addoption(parser: pytest.Parser) -> None:
    outcomes.add_options(parser)
    quick.add_options(parser)
    long_tests.add_options(parser)
    left_out.add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    gc.disable()  # until all tests are collected: nothing is freed before that, and each worker does it
    outcomes.configure(config)
    lacks.configure(config)
    # SIGINT is ignored in a script's background jobs, and programs started by tests would inherit that.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if is_required() and not hasattr(config, "workerinput"):
        left_out.refuse_without_genuine(config.args)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    if quick.leaves_out(config, collection_path):
        return True
    if not collection_path.is_relative_to(REPOSITORY):
        return None
    if not is_required() and any(left_out.lacking_for(collection_path)):
        return True
    return True if absent_plugins.is_needed_by(collection_path) else None


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


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node: Any, ids: list[str]) -> None:
    """Say at the beginning how many tests there are."""
    reporter = node.config.pluginmanager.get_plugin("terminalreporter")
    if node.gateway.id == "gw0" and reporter is not None:
        reporter.write_line(f"{len(ids)} tests")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if os.name == "nt":
        return  # what is missing there cannot be installed
    lines = left_out.report(terminalreporter.config)
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
def constants() -> Iterator[Constants]:
    """Change constants of pipros until the test ends: `constants(HANDSHAKES=8)`."""
    with ExitStack() as stack:
        yield lambda **values: stack.enter_context(changed(**values))


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


@pytest.fixture(scope="module")
def module_ros(tmp_path_factory: pytest.TempPathFactory, bare_tools: Path) -> Iterator[RosSystem]:
    """The same for all tests of a module, which must leave it as it was."""
    port = ClaimedPort()
    system = RosSystem(port.number, tmp_path_factory.mktemp("home"), bare_tools)
    yield system
    system.close()
    port.release()
