"""Collect launch files in pytest, with one item per `<test>`."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros_tools.launch.console import Console
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.model import Launch, Test
from pipros_tools.launch.run_id import new_run_id
from pipros_tools.launch.xml import load
from pipros_tools.testing.fixture import LaunchFixture
from pipros_tools.testing.junit_cases import as_property
from pipros_tools.testing.results import Case, Outcome
from pipros_tools.testing.rostest import Plan, Rostest
from pipros_tools.testing.runner import CaseResult
from pipros_workspace.index import PackageIndex


class TestDidNotPass(Exception):
    """A test program failed or could not run. The error text is the complete report."""

    __test__ = False


class LaunchFileCollector(pytest.File):
    """A launch file with tests."""

    def collect(self) -> Iterator[pytest.Item]:
        index = PackageIndex.from_environment()
        try:
            launch = read_launch_file(self.path, self.config, index)
        except PiprosError as error:
            raise self.CollectError(str(error)) from None
        for test in launch.tests:
            # Each test runs separately, with its own master and all nodes in the file.
            yield LaunchTestItem.from_parent(
                self, name=test.test_name, launch=replace(launch, tests=(test,)), test=test, index=index
            )


def read_launch_file(file: Path, config: pytest.Config, index: PackageIndex) -> Launch:
    """Load a launch file with the arguments on pytest's command line.

    Raises:
        LaunchError: the file is invalid.
        PiprosError: an option `--ros-arg` is invalid.
    """
    arguments = {}
    for word in config.getoption("ros_arg"):
        name, separator, value = word.partition(":=")
        if not separator:
            raise PiprosError(f"--ros-arg={word} must have the form NAME:=VALUE")
        arguments[name.strip()] = value.strip()
    return load([str(file)], arguments, context=LoadContext.of_process(index))


class LaunchTestItem(pytest.Item):
    """One `<test>` in a launch file."""

    def __init__(self, *, launch: Launch, test: Test, index: PackageIndex, **more: Any) -> None:
        super().__init__(**more)
        self._launch = launch
        self._test = test
        self._index = index

    def runtest(self) -> None:
        """Run the test program with the file's nodes on a private master.

        Raises:
            TestDidNotPass: the test failed.
        """
        with tempfile.TemporaryDirectory(prefix="pipros-results-") as results:
            broken = self._run(Path(results))
        if broken:
            raise TestDidNotPass("\n\n".join(map(_report, broken)))

    def reportinfo(self) -> tuple[Path, int | None, str]:
        place = self._test.node.place
        return self.path, None if place is None else place.line - 1, f"<test> {self.name}"

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, (TestDidNotPass, PiprosError)):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def _run(self, results: Path) -> list[Case]:
        """Return the cases that did not pass. Add the test program's output to the pytest report."""
        owner = self._index.containing(self.path)
        package = owner.name if owner else self.path.parent.name
        environment = Environment.from_os()
        plan = Plan(package, self.path, self._launch, results_base=results)
        rostest = Rostest(
            plan,
            self._index,
            lambda: LaunchFixture(self._launch, self._index, environment, Console(has_title=False)),
        )
        result = CaseResult(io.StringIO())
        with _launcher_log(environment):
            try:
                rostest.suite()(result)
            finally:
                # unittest does not call tearDown on Ctrl-C.
                rostest.tear_down()
        suites = [suite for _, suite in rostest.results]
        for suite in suites:
            self.add_report_section("call", f"stdout of {self.name}", suite.stdout)
            self.add_report_section("call", f"stderr of {self.name}", suite.stderr)
        of_program = [case for suite in suites for case in suite.cases]
        # Only workers of pytest-xdist have the attribute `workerinput`.
        if self.config.getoption("xmlpath", None) or "workerinput" in vars(self.config):
            started = [case for case in result.cases if case.outcome is not Outcome.PASSED or not of_program]
            self.user_properties.append(as_property([*started, *of_program]))
        return [case for case in (*result.cases, *of_program) if case.outcome is not Outcome.PASSED]


def _report(case: Case) -> str:
    return f"{case.outcome.name}: {case.name} ({case.class_name})\n{case.text.rstrip()}"


@contextmanager
def _launcher_log(environment: Environment) -> Iterator[None]:
    """Set a unique log file name, which identifies any nodes left running if pytest is killed."""
    folder = LogFolder(environment.log_dir.absolute())
    before = os.environ.get("ROS_LOG_FILENAME")
    os.environ["ROS_LOG_FILENAME"] = str(folder.file_of_launcher(f"pytest-{new_run_id()}"))
    try:
        yield
    finally:
        if before is None:
            del os.environ["ROS_LOG_FILENAME"]
        else:
            os.environ["ROS_LOG_FILENAME"] = before
