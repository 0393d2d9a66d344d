"""rostest: each test of a launch file runs on a fresh system with all nodes of the file around it.

The outer run is one of unittest too: a case for each `<test>`, which passes when the test program ran to its
end and left results. Whether those results are good is a second question, and a second exit code.
"""

from __future__ import annotations

import unittest
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pipros.errors import NotFound, PiprosError
from pipros.input_file import read_file
from pipros.launch.model import Launch, Test
from pipros.testing.result_paths import XML_OUTPUT_FLAG, prepare_path, results_file
from pipros.testing.results import Suite, Totals
from pipros.testing.xunit import parse_suites
from pipros.workspace.executables import find_executables
from pipros.workspace.index import PackageIndex

# Reports leave out the frames of modules with this mark: what failed is said in words.
__unittest = True

_CASE_CLASS = "RosTest"
# The result files of genuine rostest name this class, and dashboards group by it.
_CASE_MODULE = "rostest.runner"


class TestProgramTimedOut(PiprosError):
    """A test program ran longer than its time limit, and was ended."""

    __test__ = False  # not one of pytest's


class Stage(Protocol):
    """A running system for one test: its own master or an existing one, the nodes of the launch file."""

    @property
    def run_id(self) -> str: ...

    def set_up(self) -> None:
        """Gets the master, the parameters and the process monitor ready."""

    def start_nodes(self) -> Sequence[str]:
        """Starts the nodes of the launch file; the names of those that could not be started."""

    def run_test(self, test: Test, arguments: Sequence[str]) -> bool:
        """Starts the test program and waits for its end; False when it could not be started.

        Raises:
            TestProgramTimedOut: its time limit is over; it is ended then.
        """

    def tear_down(self) -> None:
        """Ends everything that was started. Harmless when nothing was, and when repeated."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What to run, and where results go.

    Attributes:
        package: whose results they are.
        file: the launch file.
        launch: what it asks for.
        results_base: takes the place of the folder of test results.
        text: test programs report on the console and write no results.
    """

    package: str
    file: Path
    launch: Launch
    results_base: Path | None = None
    text: bool = False


class Rostest:
    """Makes the unittest cases of a plan, and gathers the results that test programs leave.

    Attributes:
        results: the suites that were read, each under `package.rosunit-name`.
        was_set_up: whether any stage came up.
    """

    def __init__(self, plan: Plan, index: PackageIndex, open_stage: Callable[[], Stage]) -> None:
        self._plan = plan
        self._index = index
        self._open_stage = open_stage
        self._stage: Stage | None = None
        self.results: list[tuple[str, Suite]] = []
        self.was_set_up = False

    def suite(self) -> unittest.TestSuite:
        """A case for each test, in the order of their names; two tests of one name are a case that fails."""
        methods: dict[str, Callable[[unittest.TestCase], None]] = {}
        for test in self._plan.launch.tests:
            name = f"test{test.test_name}"
            methods[name] = self._refusal(test) if name in methods else self._case(test)
        owner = self

        def set_up(_case: unittest.TestCase) -> None:
            owner.set_up()

        def tear_down(_case: unittest.TestCase) -> None:
            owner.tear_down()

        kind = type(
            _CASE_CLASS,
            (unittest.TestCase,),
            {"setUp": set_up, "tearDown": tear_down, "__module__": _CASE_MODULE, **methods},
        )
        return unittest.TestLoader().loadTestsFromTestCase(kind)

    def set_up(self) -> None:
        """Opens a fresh stage."""
        stage = self._stage = self._open_stage()
        _say(f"setup[{self._plan.file}] run_id[{stage.run_id}] starting")
        try:
            stage.set_up()
        except BaseException:
            self.tear_down()
            raise
        self.was_set_up = True
        _say(f"setup[{self._plan.file}] run_id[{stage.run_id}] done")

    def tear_down(self) -> None:
        """Ends what the stage holds. To be called also when the run was interrupted; harmless otherwise."""
        stage, self._stage = self._stage, None
        if stage is None:
            return
        _say(f"tearDown[{self._plan.file}]")
        stage.tear_down()
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
            prefix = f"{self._plan.package}.rosunit-{test.test_name}"
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
        """Why the test program cannot run at all; empty when it can."""
        node = test.node
        try:
            found = find_executables(self._index.find(node.package), node.type)
        except NotFound:
            return f"Package [{node.package}] for test node [{node.package}/{node.type}] does not exist"
        if not found.runnable:
            return f"Test node [{node.package}/{node.type}] does not exist or is not executable"
        return ""

    def _run_once(self, case: unittest.TestCase, test: Test) -> list[Suite]:
        """Runs the test program on the stage as it is; the results that it left, none in text mode."""
        stage = self._stage
        if stage is None:
            raise RuntimeError("a test runs between set_up and tear_down")
        name = test.test_name
        _say(f"Running test [{name}]")
        if failed := list(stage.start_nodes()):
            case.fail(f"Test Fixture Nodes {failed} failed to launch")

        file = results_file(self._plan.package, name, base=self._plan.results_base)
        if prepare_path(file):
            _say(f"removing previous test results file [{file}]")
        _say(f"running test {name}")
        arguments = [XML_OUTPUT_FLAG + str(file), *(["--text"] if self._plan.text else [])]
        if not stage.run_test(test, arguments):
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
