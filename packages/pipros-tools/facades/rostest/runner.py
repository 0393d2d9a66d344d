"""Create unittest classes from launch files with tests, and provide the results."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Callable
from pathlib import Path

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.launch.console import Console
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.xml import load
from pipros_tools.testing.fixture import LaunchFixture
from pipros_tools.testing.rostest import Plan, Rostest
from pipros_workspace.index import PackageIndex
from roslaunch.config import ROSLaunchConfig, load_config_default
from rostest.rostest_parent import ROSTestLaunchParent
from rostest.rostestutil import (
    createXMLRunner,
    printlog,
    printlogerr,
    printRostestSummary,
    printSummary,
    xmlResultsFile,
)
from rosunit.junitxml import Result, result_of

__all__ = [
    "ROS_TEST_RESULTS_DIR",
    "ROSTestLaunchParent",
    "createUnitTest",
    "createXMLRunner",
    "failDuplicateRunner",
    "failRunner",
    "getConfig",
    "getResults",
    "getRostestParents",
    "printRostestSummary",
    "printSummary",
    "printlog",
    "printlogerr",
    "setTextMode",
    "setUp",
    "tearDown",
    "xmlResultsFile",
]

_star_names(__name__, "logging os roslaunch roslib rospkg rosunit sys time unittest")

ROS_TEST_RESULTS_DIR = "ROS_TEST_RESULTS_DIR"

_Method = Callable[[unittest.TestCase], None]


class _Made:
    """The test runs created by `createUnitTest`, and the module's settings."""

    def __init__(self) -> None:
        self.runs: list[tuple[Rostest, ROSLaunchConfig]] = []
        self.has_text = False
        self.parents: list[ROSTestLaunchParent] = []


_made = _Made()


def createUnitTest(  # Noetic's name
    pkg: str,
    test_file: str,
    reuse_master: bool = False,
    clear: bool = False,
    results_base_dir: str | None = None,
) -> type[unittest.TestCase]:
    """Return a unittest class with a case for each `<test>` in a launch file.

    Tests with the same name become one case, which fails.

    Args:
        pkg: the package to which the results belong.
        reuse_master: whether to use the master at `ROS_MASTER_URI` instead of starting one.
        clear: whether to delete the parameters of a reused master first.
        results_base_dir: folder for test results, instead of the default.

    Raises:
        RLException: the file is invalid.
    """
    index, environment = PackageIndex.from_environment(), Environment.from_os()
    launch = load([test_file], context=LoadContext.of_process(index))
    launch.check_machines()
    console = Console(has_title=False)
    base = Path(results_base_dir) if results_base_dir else None
    run = Rostest(
        Plan(pkg, Path(test_file).absolute(), launch, base, _made.has_text),
        index,
        lambda: LaunchFixture(
            launch,
            index,
            environment,
            console,
            reuse_master=reuse_master,
            clear=clear,
            text=_made.has_text,
        ),
    )
    _made.runs.append((run, load_config_default([test_file], None)))
    return run.case_class()


def setTextMode(val: bool) -> None:
    """Set whether test programs print to the console instead of writing result files."""
    _made.has_text = bool(val)
    for run, _ in _made.runs:
        run.write_text(text=_made.has_text)


def getResults() -> Result:
    """Return the results written by test programs so far."""
    total = Result("rostest")
    for run, _ in _made.runs:
        for prefix, suite in run.results:
            total.accumulate(result_of(suite, prefix.partition(".rosunit-")[2], prefix))
    return total


def getConfig() -> ROSLaunchConfig | None:
    """Return the configuration of the last launch file passed to `createUnitTest`, or None."""
    return _made.runs[-1][1] if _made.runs else None


def getRostestParents() -> list[ROSTestLaunchParent]:
    """Return an empty list, because each case tears down its own launch."""
    return _made.parents


def failRunner(testName: str, message: str) -> _Method:
    """Return a test method that fails with a message."""
    _ = testName

    def fn(self: unittest.TestCase) -> None:
        print(message, file=sys.stderr)
        self.fail(message)

    return fn


def failDuplicateRunner(testName: str) -> _Method:
    """Return a test method that fails because another test has the same name."""
    return failRunner(testName, f"Duplicate tests named [{testName}] in rostest suite")


def setUp(self: unittest.TestCase) -> None:
    """Start the master and the nodes, like `setUp` in the classes created by `createUnitTest`."""
    _run_of(self).set_up()


def tearDown(self: unittest.TestCase) -> None:
    """Stop the master and the nodes, like `tearDown` in the classes created by `createUnitTest`."""
    _run_of(self).tear_down()


def _run_of(case: unittest.TestCase) -> Rostest:
    run: Rostest = case.rostest  # type: ignore[attr-defined]  # createUnitTest's classes have it
    return run
