"""Test programs that run without a ROS system."""

from __future__ import annotations

import os
import unittest
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.testing.bare import BareTest
from pipros_tools.testing.rostest import TestProgramTimedOut
from pipros_tools.testing.runner import case_name
from pipros_tools.testing.summary import case_summary, unittest_summary
from pipros_workspace.index import PackageIndex
from rosunit import junitxml
from rosunit.core import (
    create_xml_runner,
    printerrlog,
    printlog,
    printlog_bold,
    rostest_name_from_path,
    xml_results_file,
)

__all__ = [
    "BARE_TIME_LIMIT",
    "TIMEOUT_SIGINT",
    "TIMEOUT_SIGTERM",
    "BareTestCase",
    "TestTimeoutException",
    "create_xml_runner",
    "print_runner_summary",
    "print_unittest_summary",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "rostest_name_from_path",
    "xml_results_file",
]

# unittest's reports omit stack frames of modules that define this variable.
__unittest = True

BARE_TIME_LIMIT = 60.0
TIMEOUT_SIGINT = 15.0
TIMEOUT_SIGTERM = 2.0


_star_names(
    __name__, "errno os rospkg rosunit.junitxml signal io:StringIO subprocess time traceback unittest"
)


class TestTimeoutException(Exception):
    """A test program exceeded its time limit."""

    __test__ = False  # pytest must not collect this class


class BareTestCase(unittest.TestCase):
    """Test case that runs a program.

    The case passes if the program exits within the time limit and has written its results, even if these
    contain failures. In text mode, no results are required.

    Attributes:
        args: the program's command line.
        retry: the number of retries left in case of failures.
        results: the results that the program has written.
    """

    def __init__(
        self,
        exe: str,
        args: Sequence[str],
        retry: int = 0,
        time_limit: float | None = None,
        test_name: str | None = None,
        text_mode: bool = False,
        package_name: str | None = None,
    ) -> None:
        super().__init__()
        self.text_mode = text_mode
        self.exe = os.path.abspath(exe)
        self.package: str | None = package_name or getattr(
            PackageIndex.from_environment().containing(Path(self.exe)), "name", None
        )
        self.test_name = test_name or os.path.basename(exe)
        self.args = [*(["python"] if self.exe.endswith(".py") else []), self.exe, *args]
        if text_mode:
            self.args.append("--text")
        self.retry = retry
        self.time_limit = time_limit or BARE_TIME_LIMIT
        self.results = junitxml.Result(self.test_name)
        self._arguments = list(args)

    def runTest(self) -> None:  # unittest requires this name
        """Run the program. While it fails and retries are left, run it again."""
        if self.package is None:
            self.fail("unable to determine package of executable")
        test = BareTest(
            Path(self.exe),
            self._arguments,
            self.package,
            self.test_name,
            self.time_limit,
            text=self.text_mode,
        )
        results = self._run(test)
        while self.retry and (results is None or results.num_errors or results.num_failures):
            self.retry -= 1
            printlog("test [%s] failed, retrying. Retries left: %s", self.test_name, self.retry)
            results = self._run(test)
        self.results = results = results or self.results
        sums = results.num_errors, results.num_failures, results.num_tests
        printlog("test [%s] results summary: %s errors, %s failures, %s tests", self.test_name, *sums)

    def _run(self, test: BareTest) -> junitxml.Result | None:
        """Run the program once. Return its results, or None if it timed out and retries are left."""
        printlog("Running test [%s]", self.test_name)
        try:
            test.run_once(self)
        except TestProgramTimedOut as error:
            if not self.retry:
                raise TestTimeoutException(str(error)) from error
            printerrlog("test [%s] timed out", self.test_name)
            return None
        printlog("test [%s] finished", self.test_name)
        if self.text_mode or self.package is None:
            return self.results
        return junitxml.read(xml_results_file(self.package, self.test_name), self.test_name)


def print_unittest_summary(result: unittest.TestResult) -> None:
    """Print the number of tests, and the names of the tests with errors and failures."""
    names: list[list[str]] = [
        [case_name(test) for test, _ in broken] for broken in (result.errors, result.failures)
    ]
    print(unittest_summary(result.testsRun, *names))


def print_runner_summary(
    runner_results: unittest.TestResult, junit_results: junitxml.Result, runner_name: str = "ROSUNIT"
) -> None:
    """Print the result of each test case, and the programs that could not run."""
    lines = "".join(result.description for result in junit_results.test_case_results).splitlines()
    not_run = [case_name(test) for test, _ in runner_results.failures]
    lines += [f"[{name}][failed]" for name in not_run]
    summary = case_summary(
        lines,
        junit_results.num_tests,
        junit_results.num_errors + len(runner_results.errors),
        junit_results.num_failures + len(runner_results.failures),
        runner_name,
    )
    print("\n".join(summary))
    if not_run:
        print("ERROR: The following tests failed to run:")
        print("\n".join(f" * {name}" for name in not_run) + "\n")
