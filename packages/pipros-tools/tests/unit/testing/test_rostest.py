"""How rostest runs the tests of a launch file, without processes."""

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from pipros_tools.launch import model
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG
from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.rostest import Plan, Rostest, TestProgramTimedOut
from pipros_tools.testing.runner import CaseResult
from pipros_tools.testing.xunit import format_suite
from pipros_workspace.index import PackageIndex

ABSENT = "does not exist or is not executable"
PASSED = Suite("s", (Case("c", "test_it"),))
FAILED = Suite("s", (Case("c", "test_it", 0.0, Outcome.FAILURE, "AssertionError", "no\n"),))


@dataclass
class FakeStage:
    """Write the given results to the files of the test programs, and record the calls."""

    leaves: Callable[[], Suite | None] = lambda: PASSED
    failing_nodes: Mapping[str, str] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)
    run_id: str = "an-id"

    def set_up(self) -> None:
        self.asked.append("set_up")

    def start_nodes(self) -> Mapping[str, str]:
        self.asked.append("start_nodes")
        return self.failing_nodes

    def run_test(self, test: model.Test, arguments: Sequence[str]) -> bool:
        self.asked.append(f"run {test.test_name}")
        left = self.leaves()
        if left:
            Path(arguments[0].removeprefix(XML_OUTPUT_FLAG)).write_text(format_suite(left))
        return True

    def tear_down(self) -> None:
        self.asked.append("tear_down")


@pytest.fixture
def index(tmp_path: Path) -> PackageIndex:
    package = tmp_path / "src" / "pkg"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>pkg</name></package>")
    for name in ("a.py", "b.py"):
        (package / name).write_text("#!/bin/sh\n")
        (package / name).chmod(0o755)
    (package / "plain.py").write_text("#!/bin/sh\n")
    return PackageIndex([tmp_path / "src"])


def a_test(name: str = "a", package: str = "pkg", retry: int = 0, type: str = "a.py") -> model.Test:  # noqa: A002
    return model.Test(LaunchNode(package, type, name), name, retry=retry)


def run(
    index: PackageIndex, folder: Path, stage: FakeStage, *tests: model.Test, text: bool = False
) -> tuple[CaseResult, Rostest, str]:
    plan = Plan("pkg", Path("/ws/pkg/a.test"), Launch(tests=tests), folder, text)
    rostest = Rostest(plan, index, lambda: stage)
    result, printed = CaseResult(io.StringIO()), io.StringIO()
    with redirect_stdout(printed):
        rostest.suite()(result)
    return result, rostest, printed.getvalue()


def test_every_test_gets_a_stage_of_its_own_in_the_order_of_names(index: PackageIndex, tmp_path) -> None:
    stage = FakeStage()

    result, rostest, _ = run(index, tmp_path, stage, a_test("b"), a_test("a"))

    assert stage.asked == [
        *("set_up", "start_nodes", "run a", "tear_down"),
        *("set_up", "start_nodes", "run b", "tear_down"),
    ]
    assert [case.name for case in result.cases] == ["testa", "testb"]
    assert [prefix for prefix, _ in rostest.results] == ["pkg.rosunit-a", "pkg.rosunit-b"]


def test_the_steps_are_printed_with_the_texts_of_rostest(index: PackageIndex, tmp_path: Path) -> None:
    _, _, printed = run(index, tmp_path, FakeStage(), a_test())

    file = tmp_path / "pkg" / "rosunit-a.xml"
    assert printed.splitlines() == [
        "[ROSTEST]setup[/ws/pkg/a.test] run_id[an-id] starting",
        "[ROSTEST]setup[/ws/pkg/a.test] run_id[an-id] done", "[ROSTEST]Running test [a]",
        "[ROSTEST]running test a", "[ROSTEST]test [a] finished", f"[ROSTEST]test [a] results are in [{file}]",
        "[ROSTEST]test [a] results summary: 0 errors, 0 failures, 1 tests",
        "[ROSTEST][ROSTEST] test [a] done", "[ROSTEST]tearDown[/ws/pkg/a.test]",
        "[ROSTEST]rostest teardown /ws/pkg/a.test complete",
    ]  # fmt: skip


def test_a_test_program_whose_cases_failed_did_run(index: PackageIndex, tmp_path: Path) -> None:
    result, rostest, _ = run(index, tmp_path, FakeStage(leaves=lambda: FAILED), a_test())

    assert result.wasSuccessful()
    assert [suite.failures for _, suite in rostest.results] == [1]


def test_a_failed_test_is_run_again_on_a_fresh_stage_as_often_as_the_file_says(index, tmp_path) -> None:
    outcomes = iter([FAILED, FAILED, PASSED])
    stage = FakeStage(leaves=lambda: next(outcomes))

    _, rostest, printed = run(index, tmp_path, stage, a_test(retry=3))

    assert stage.asked.count("set_up") == stage.asked.count("tear_down") == 3
    assert "[ROSTEST]test [a] failed, retrying. Retries left: 2\n" in printed
    assert [suite.failures for _, suite in rostest.results] == [0]


def test_the_last_failure_counts_when_no_retry_is_left(index: PackageIndex, tmp_path: Path) -> None:
    stage = FakeStage(leaves=lambda: FAILED)

    _, rostest, _ = run(index, tmp_path, stage, a_test(retry=1))

    assert stage.asked.count("run a") == 2
    assert [suite.failures for _, suite in rostest.results] == [1]


@pytest.mark.parametrize(("tests", "report"), [
    ([a_test(package="nopkg")], "Package [nopkg] for test node [nopkg/a.py] does not exist"),
    ([a_test(type="aa.py")], f"Test node [pkg/aa.py] {ABSENT}\nDid you mean a.py?"),
    pytest.param(
        [a_test(type="plain.py")],
        f"Test node [pkg/plain.py] {ABSENT}\nThere is SRC/pkg/plain.py",
        marks=pytest.mark.needs("executable files"),
    ),
    ([a_test(), a_test(type="b.py")], "Duplicate tests named [a] in rostest suite"),
])  # fmt: skip
def test_tests_that_cannot_run_are_failures_with_a_reason(
    index: PackageIndex, tmp_path: Path, tests: list[model.Test], report: str
) -> None:
    stage = FakeStage()

    result, rostest, _ = run(index, tmp_path, stage, *tests)

    expected = report.replace("SRC", str(tmp_path / "src")) + "\n"
    assert [(case.outcome, case.text) for case in result.cases] == [(Outcome.FAILURE, expected)]
    assert (rostest.results, stage.asked) == ([], ["set_up", "tear_down"])


def test_nodes_that_do_not_start_are_a_failure(index: PackageIndex, tmp_path: Path) -> None:
    result, _, _ = run(index, tmp_path, FakeStage(failing_nodes={"talker": "it is gone"}), a_test())

    assert result.cases[0].text == "Test Fixture Nodes ['talker'] failed to launch\nit is gone\n"


def test_a_program_without_results_fails_even_if_old_results_exist(index: PackageIndex, tmp_path) -> None:
    (tmp_path / "pkg").mkdir()
    (tmp_path / "pkg" / "rosunit-a.xml").write_text(format_suite(PASSED))

    result, _, printed = run(index, tmp_path, FakeStage(leaves=lambda: None), a_test())

    assert result.cases[0].text == "test [a] did not generate test results\n"
    assert "removing previous test results file" in printed


def test_a_timeout_is_an_error_and_the_stage_is_torn_down(index: PackageIndex, tmp_path: Path) -> None:
    def too_slow() -> Suite:
        raise TestProgramTimedOut("max time [2.0s] allotted for test [a] of type [pkg/a.py]")

    stage = FakeStage(leaves=too_slow)

    result, _, _ = run(index, tmp_path, stage, a_test(retry=3))

    assert [(case.outcome, case.kind) for case in result.cases] == [(Outcome.ERROR, "TestProgramTimedOut")]
    assert stage.asked == ["set_up", "start_nodes", "run a", "tear_down"]


def test_in_text_mode_programs_get_the_option_and_no_results_are_expected(index, tmp_path) -> None:
    asked: list[Sequence[str]] = []

    class Remembering(FakeStage):
        def run_test(self, test: model.Test, arguments: Sequence[str]) -> bool:
            asked.append(arguments)
            return True

    result, rostest, _ = run(index, tmp_path, Remembering(), a_test(), text=True)

    assert [arguments[1:] for arguments in asked] == [["--text"]]
    assert (result.wasSuccessful(), rostest.results) == (True, [])


def test_an_interruption_leaves_the_stage_to_be_torn_down_once(index: PackageIndex, tmp_path: Path) -> None:
    def interrupted() -> Suite:
        raise KeyboardInterrupt

    stage = FakeStage(leaves=interrupted)
    rostest = Rostest(Plan("pkg", Path("a.test"), Launch(tests=(a_test(),)), tmp_path), index, lambda: stage)

    with redirect_stdout(io.StringIO()):
        with pytest.raises(KeyboardInterrupt):
            rostest.suite()(CaseResult(io.StringIO()))
        rostest.tear_down()
        rostest.tear_down()

    assert stage.asked.count("tear_down") == 1
