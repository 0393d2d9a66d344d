"""The end of a test script: `rostest.rosrun` and `rosunit.unitrun` without a ROS system."""

from __future__ import annotations

import unittest
from pathlib import Path

import pytest

import rosunit
from pipros_tools.testing.script_runner import run_program


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


def test_text_asks_for_unittests_report_and_no_file(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not run_program("pkg", "t", Broken, ["script", "--text"])

    printed = capsys.readouterr()
    assert "FAILED (failures=1, errors=1)" in printed.err
    assert " * ERRORS: 1 [test_error]\n * FAILURES: 1 [test_failure]\n" in printed.out
    assert not results.exists()


def test_tests_may_be_given_by_a_dotted_name(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program("pkg", "t", f"{__name__}.Fine.test_it", [])

    assert "[Testcase: test_it] ... ok" in capsys.readouterr().out


def test_unitrun_ends_the_process_with_1_only_when_tests_do_not_pass(results: Path) -> None:
    rosunit.unitrun("pkg", "t", Fine, sysargs=[])

    with pytest.raises(SystemExit) as ended:
        rosunit.unitrun("pkg", "t", Broken, sysargs=[])
    assert ended.value.code == 1


def test_result_files_are_named_after_package_runner_and_test(results: Path) -> None:
    assert rosunit.xml_results_file("pkg", "a/b") == f"{results}/pkg/rosunit-a_b.xml"
    assert rosunit.xml_results_file("pkg", "t", True, env={"ROS_HOME": f"{results}/h"}) == (
        f"{results}/h/test_results/pkg/rostest-t.xml"
    )
    assert rosunit.rostest_name_from_path("/ws/pkg", "/ws/pkg/test/a.test") == "test_a"
