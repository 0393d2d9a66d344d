"""The runner of test cases: its console output and its result files."""

# ruff: noqa: PT009 - the cases that are run are those of unittest

import io
import sys
import unittest
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

import pytest

import rosunit
from pipros_tools.testing.result_paths import NoPlaceForResults
from pipros_tools.testing.results import Outcome, Suite
from pipros_tools.testing.runner import CaseResult, XmlRunner
from pipros_tools.testing.script_runner import run_program
from pipros_tools.testing.xunit import parse_suites
from tests.support.full_disk import files_limited_to


def case_of(**methods: Callable[[unittest.TestCase], None]) -> unittest.TestSuite:
    kind = type("Kinds", (unittest.TestCase,), methods)
    return unittest.TestLoader().loadTestsFromTestCase(kind)


def run(suite: unittest.TestSuite, file: Path) -> tuple[CaseResult, str]:
    console = io.StringIO()
    with redirect_stdout(console):
        result = XmlRunner(file).run(suite)
    return result, console.getvalue()


def read(file: Path) -> Suite:
    (suite,) = parse_suites(file.read_bytes(), str(file))
    return suite


def test_a_case_that_passes_is_one_line(tmp_path: Path) -> None:
    result, console = run(case_of(test_it=lambda self: None), tmp_path / "r.xml")

    assert console == "[Testcase: test_it] ... ok\n"
    assert result.wasSuccessful()


def test_a_failure_has_its_text_and_line_without_frames_of_unittest(tmp_path: Path) -> None:
    _, console = run(case_of(test_it=lambda self: self.assertEqual(1, 2)), tmp_path / "r.xml")

    lines = console.splitlines()
    assert lines[:2] == ["[Testcase: test_it] ... FAILURE!", "FAILURE: 1 != 2"]
    assert lines[2].startswith(f'  File "{__file__}", line ')
    assert lines[-1] == "-" * 80
    assert "unittest/case.py" not in console


def test_an_exception_is_an_error_and_not_a_failure(tmp_path: Path) -> None:
    def test_it(self: unittest.TestCase) -> None:
        raise KeyError("gone")

    result, console = run(case_of(test_it=test_it), tmp_path / "r.xml")

    assert console.startswith("[Testcase: test_it] ... ERROR!\nERROR: 'gone'\n")
    assert [(case.outcome, case.kind) for case in result.cases] == [(Outcome.ERROR, "KeyError")]


def test_output_of_cases_is_written_to_the_file_and_not_to_the_console(tmp_path: Path) -> None:
    def test_it(self: unittest.TestCase) -> None:
        print("to out")
        print("to err", file=sys.stderr)

    _, console = run(case_of(test_it=test_it), tmp_path / "r.xml")

    assert "to out" not in console
    suite = read(tmp_path / "r.xml")
    assert (suite.stdout, suite.stderr) == ("to out\n", "to err\n")


def test_failed_sub_tests_are_separate_cases(tmp_path: Path) -> None:
    def test_it(self: unittest.TestCase) -> None:
        for level in (0, 1.5, 2):
            with self.subTest(level=level):
                self.assertEqual(level, 0)

    run(case_of(test_it=test_it), tmp_path / "r.xml")

    suite = read(tmp_path / "r.xml")
    assert [case.name for case in suite.cases] == ["test_it (level=1.5)", "test_it (level=2)"]
    assert suite.failures == 2


def test_a_success_that_was_expected_to_fail_is_a_failure(tmp_path: Path) -> None:
    test_it = unittest.expectedFailure(lambda self: None)

    result, _ = run(case_of(test_it=test_it), tmp_path / "r.xml")

    assert not result.wasSuccessful()
    assert read(tmp_path / "r.xml").failures == 1


def test_skipped_cases_and_expected_failures_pass(tmp_path: Path) -> None:
    skipped = unittest.skip("no reason")(lambda self: None)
    expected = unittest.expectedFailure(lambda self: self.fail("as expected"))

    result, console = run(case_of(test_a=skipped, test_b=expected), tmp_path / "r.xml")

    assert console == "[Testcase: test_a] ... ok\n[Testcase: test_b] ... ok\n"
    assert result.wasSuccessful()


def test_a_class_that_cannot_be_set_up_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class Broken(unittest.TestCase):
        @classmethod
        def setUpClass(cls) -> None:
            raise OSError("no such robot")

        def test_it(self) -> None:
            pass

    suite = unittest.TestLoader().loadTestsFromTestCase(Broken)
    _, console = run(suite, tmp_path / "r.xml")

    assert "ERROR: no such robot" in console
    assert read(tmp_path / "r.xml").errors == 1
    assert not run_program("pkg", "t", Broken, ["--text"])
    assert " * ERRORS: 1 [setUpClass (" in capsys.readouterr().out


def test_an_interrupted_run_leaves_no_file_that_could_be_taken_for_a_passed_one(tmp_path: Path) -> None:
    def test_b(self: unittest.TestCase) -> None:
        raise KeyboardInterrupt

    (tmp_path / "r.xml").write_text("the results of yesterday")

    with pytest.raises(KeyboardInterrupt):
        run(case_of(test_a=lambda self: None, test_b=test_b), tmp_path / "r.xml")

    assert not (tmp_path / "r.xml").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_no_case_runs_if_its_results_cannot_be_written(tmp_path: Path) -> None:
    ran: list[unittest.TestCase] = []
    with (
        files_limited_to(0),
        pytest.raises(NoPlaceForResults, match=r"r\.xml.*Set ROS_TEST_RESULTS_DIR to a writable folder"),
    ):
        XmlRunner(tmp_path / "r.xml").run(case_of(test_it=ran.append))
    assert (ran, list(tmp_path.iterdir())) == ([], [])


# The end of a test script: `rostest.rosrun` and `rosunit.unitrun` without a ROS system.


class Fine(unittest.TestCase):
    __test__ = False  # pytest must not collect the class

    def test_it(self) -> None:
        pass


class Broken(unittest.TestCase):
    __test__ = False

    def test_error(self) -> None:
        raise KeyError("gone")

    def test_failure(self) -> None:
        self.fail()


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("ROS_TEST_RESULTS_DIR", str(tmp_path / "results"))
    return tmp_path / "results"


def test_success_is_reported_as_noetic_does(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program("composiv_tryouts", "composiv_talker", Fine, [])

    assert capsys.readouterr().out == (
        f"[ROSUNIT] Outputting test results to {results}/composiv_tryouts/rosunit-composiv_talker.xml\n"
        "[Testcase: test_it] ... ok\n"
        "-------------------------------------------------------------\n"
        "SUMMARY:\n"
        "\x1b[32m * RESULT: SUCCESS\x1b[0m\n"
        " * TESTS: 1\n"
        " * ERRORS: 0 []\n"
        " * FAILURES: 0 []\n"
        "\n"
    )


def test_the_summary_names_the_failed_cases(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert not run_program("pkg", "t", Broken, [])

    summary = capsys.readouterr().out.partition("SUMMARY:\n")[2]
    assert summary == (
        " * RESULT: FAIL\n * TESTS: 2\n * ERRORS: 1 [test_error]\n * FAILURES: 1 [test_failure]\n\n"
    )


def test_the_result_file_can_be_named_on_the_command_line(results: Path, tmp_path: Path) -> None:
    run_program("pkg", "t", Fine, ["script", f"--gtest_output=xml:{tmp_path}/deep/mine.xml"])

    assert (tmp_path / "deep" / "mine.xml").exists()
    assert not results.exists()


def test_text_asks_for_unittests_report_and_no_file(results: Path, capsys) -> None:
    assert not run_program("pkg", "t", Broken, ["script", "--text"])

    printed = capsys.readouterr()
    assert "FAILED (failures=1, errors=1)" in printed.err
    assert " * ERRORS: 1 [test_error]\n * FAILURES: 1 [test_failure]\n" in printed.out
    assert not results.exists()


def test_tests_may_be_given_by_a_dotted_name(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program("pkg", "t", f"{__name__}.Fine.test_it", [])

    assert "[Testcase: test_it] ... ok" in capsys.readouterr().out


def test_unitrun_ends_the_process_with_1_only_when_tests_do_not_pass(results: Path) -> None:
    rosunit.unitrun("pkg", "part/of it", Fine, sysargs=[])
    assert (results / "pkg" / "rosunit-of_it.xml").exists()

    with pytest.raises(SystemExit) as ended:
        rosunit.unitrun("pkg", "t", Broken, sysargs=[])
    assert ended.value.code == 1


def test_result_files_are_named_after_package_runner_and_test(results: Path) -> None:
    assert rosunit.xml_results_file("pkg", "a/b") == f"{results}/pkg/rosunit-a_b.xml"
    assert rosunit.xml_results_file("pkg", "t", True, env={"ROS_HOME": f"{results}/h"}) == (
        f"{results}/h/test_results/pkg/rostest-t.xml"
    )
    assert rosunit.rostest_name_from_path("/ws/pkg", "/ws/pkg/test/a.test") == "test_a"
