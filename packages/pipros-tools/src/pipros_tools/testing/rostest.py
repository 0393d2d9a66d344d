"""rostest: runs each test in a launch file together with all nodes in the file.

rostest itself uses unittest, with one case per `<test>`. A case passes if the test program exited and wrote
results. The results themselves are reported separately, with a different exit code.
"""

from __future__ import annotations

import unittest
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.input_file import read_file
from pipros_tools.launch.model import Launch, Test
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG, prepare_path, results_file
from pipros_tools.testing.results import Suite, Totals
from pipros_tools.testing.xunit import parse_suites
from pipros_workspace.executables import find_executables, hint_about, package_of_programs
from pipros_workspace.index import PackageIndex

# unittest's reports omit the frames of modules that define this variable.
__unittest = True

_CASE_CLASS = "RosTest"
# The result files of genuine rostest contain this class, and dashboards group results by it.
_CASE_MODULE = "rostest.runner"


class TestProgramTimedOut(PiprosError):
    """A test program exceeded its time limit."""

    __test__ = False  # pytest must not collect this class


class RequiredNodeEnded(PiprosError):
    """A `required` node exited during a test."""


class SystemFixture(Protocol):
    """A running system for one test: a new or an existing master, and the launch file's nodes.

    A protocol because its implementation, `LaunchFixture`, imports this module.
    """

    @property
    def run_id(self) -> str: ...

    def set_up(self) -> None:
        """Start or find the master, and prepare the process monitor."""

    def start_nodes(self) -> Mapping[str, str]:
        """Start the launch file's nodes. Return the names of those that cannot start, with the reasons."""

    def run_test(self, test: Test, arguments: Sequence[str]) -> bool:
        """Start the test program and wait until it exits; return False if it could not be started.

        Raises:
            TestProgramTimedOut: the program exceeded its time limit.
            RequiredNodeEnded: a `required` node exited first.
        """

    def tear_down(self) -> None:
        """Stop everything that was started. Idempotent."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The tests to run, and the destination for their results.

    Attributes:
        package: the package to which the results belong.
        file: the launch file.
        launch: the contents of the launch file.
        results_base: a folder for test results, instead of the default.
        text: whether test programs report to the console and write no result files.
    """

    package: str
    file: Path
    launch: Launch
    results_base: Path | None = None
    text: bool = False


class Rostest:
    """The unittest cases for a plan, and the results from their test programs.

    Attributes:
        results: the result suites, each with the prefix `package.rosunit-name`.
        was_set_up: whether a fixture was set up.
    """

    def __init__(self, plan: Plan, index: PackageIndex, make_fixture: Callable[[], SystemFixture]) -> None:
        self._plan = plan
        self._index = index
        self._make_fixture = make_fixture
        self._fixture: SystemFixture | None = None
        self.results: list[tuple[str, Suite]] = []
        self.was_set_up = False

    def write_text(self, *, text: bool) -> None:
        """Choose whether test programs print to the console instead of writing result files."""
        self._plan = replace(self._plan, text=text)

    def suite(self) -> unittest.TestSuite:
        """Return a suite with the cases in `case_class`."""
        return unittest.TestLoader().loadTestsFromTestCase(self.case_class())

    def case_class(self) -> type[unittest.TestCase]:
        """Return a class with one case per test, sorted by name.

        Two tests with the same name become one failing case.
        """
        methods: dict[str, Callable[[unittest.TestCase], None]] = {}
        for test in self._plan.launch.tests:
            name = f"test{test.test_name}"
            methods[name] = self._refusal(test) if name in methods else self._case(test)
        owner = self

        def set_up(_case: unittest.TestCase) -> None:
            owner.set_up()

        def tear_down(_case: unittest.TestCase) -> None:
            owner.tear_down()

        return type(
            _CASE_CLASS,
            (unittest.TestCase,),
            {
                "setUp": set_up,
                "tearDown": tear_down,
                "rostest": owner,
                "__module__": _CASE_MODULE,
                **methods,
            },
        )

    def set_up(self) -> None:
        """Create a new fixture and set it up."""
        fixture = self._fixture = self._make_fixture()
        _say(f"setup[{self._plan.file}] run_id[{fixture.run_id}] starting")
        try:
            fixture.set_up()
        except BaseException:
            self.tear_down()
            raise
        self.was_set_up = True
        _say(f"setup[{self._plan.file}] run_id[{fixture.run_id}] done")

    def tear_down(self) -> None:
        """Tear the fixture down. Must be called if the run was interrupted. Idempotent."""
        fixture, self._fixture = self._fixture, None
        if fixture is None:
            return
        _say(f"tearDown[{self._plan.file}]")
        fixture.tear_down()
        _say(f"rostest teardown {self._plan.file} complete")

    def _refusal(self, test: Test) -> Callable[[unittest.TestCase], None]:
        def refuse(case: unittest.TestCase) -> None:
            case.fail(f"Duplicate tests named [{test.test_name}] in rostest suite")

        return refuse

    def _case(self, test: Test) -> Callable[[unittest.TestCase], None]:
        def run(case: unittest.TestCase) -> None:
            if problem := self._find_problem(test):
                case.fail(problem)
            for retries_left in range(test.retry, -1, -1):
                suites = self._run_once(case, test)
                if retries_left and not all(suite.passed for suite in suites):
                    _say(f"test [{test.test_name}] failed, retrying. Retries left: {retries_left - 1}")
                    self.tear_down()
                    self.set_up()
                else:
                    break
            prefix = f"{self._plan.package}.{results_file(self._plan.package, test.test_name).stem}"
            self.results += [(prefix, suite) for suite in suites]
            if not self._plan.text:
                sums = Totals.of(suites)
                _say(
                    f"test [{test.test_name}] results summary: "
                    f"{sums.errors} errors, {sums.failures} failures, {sums.tests} tests"
                )
            _say(f"[ROSTEST] test [{test.test_name}] done")

        return run

    def _find_problem(self, test: Test) -> str:
        """Return why the test program cannot run; an empty string if it can."""
        node = test.node
        try:
            package = package_of_programs(self._index, node.package)
        except NotFound:
            return f"Package [{node.package}] for test node [{node.package}/{node.type}] does not exist"
        found = find_executables(package, node.type)
        if found.runnable:
            return ""
        what = f"Test node [{node.package}/{node.type}] does not exist or is not executable"
        return "\n".join(filter(None, [what, hint_about(package, node.type, found)]))

    def _run_once(self, case: unittest.TestCase, test: Test) -> list[Suite]:
        """Run the test program on the current fixture. Return its results, which are empty in text mode."""
        fixture = self._fixture
        if fixture is None:
            raise RuntimeError("set_up must be called first")
        name = test.test_name
        _say(f"Running test [{name}]")
        if failed := fixture.start_nodes():
            case.fail("\n".join([f"Test Fixture Nodes {[*failed]} failed to launch", *failed.values()]))

        file = results_file(self._plan.package, name, base=self._plan.results_base)
        if prepare_path(file):
            _say(f"removing previous test results file [{file}]")
        _say(f"running test {name}")
        arguments = [XML_OUTPUT_FLAG + str(file), *(["--text"] if self._plan.text else [])]
        try:
            is_started = fixture.run_test(test, arguments)
        except RequiredNodeEnded as error:
            case.fail(str(error))
        if not is_started:
            case.fail(f"test [{name}] failed to launch")
        _say(f"test [{name}] finished")
        if self._plan.text:
            return []
        if not file.is_file():
            case.fail(f"test [{name}] did not generate test results")
        _say(f"test [{name}] results are in [{file}]")
        return parse_suites(read_file(file), str(file))


def _say(text: str) -> None:
    print(f"[ROSTEST]{text}", flush=True)
