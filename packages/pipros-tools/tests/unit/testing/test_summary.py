"""The summary of rostest, word for word and colour for colour."""

from __future__ import annotations

from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.summary import runner_summary

PASSED = Case("__main__.TalkerTestCase", "test_talker_publishing", 1.1)
FAILED = Case(
    "__main__.TalkerTestCase", "test_talker_publishing", 5.0, Outcome.FAILURE, "E", "False is not true\n"
)


def test_success() -> None:
    text = runner_summary(
        Suite("rostest", (Case("rostest.runner.RosTest", "testtest_talker"),)),
        [("composiv_tryouts.rosunit-test_talker", Suite("s", (PASSED,)))],
    )

    assert text == (
        "[ROSTEST]-----------------------------------------------------------------------\n"
        "\n"
        "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]\n"
        "\n"
        "SUMMARY\n"
        "\x1b[32m * RESULT: SUCCESS\x1b[0m\n"
        " * TESTS: 1\n"
        " * ERRORS: 0\n"
        " * FAILURES: 0\n"
    )


def test_a_failed_case_is_shown_with_its_text() -> None:
    text = runner_summary(Suite("rostest"), [("pkg.rosunit-t", Suite("s", (FAILED,)))])

    assert text.partition("\n\n")[2] == (
        "[pkg.rosunit-t/test_talker_publishing][FAILURE]---------------------------------\n"
        "False is not true\n"
        "--------------------------------------------------------------------------------\n"
        "\n"
        "\n"
        "SUMMARY\n"
        "\x1b[1;31m * RESULT: FAIL\x1b[0m\n"
        " * TESTS: 1\n"
        " * ERRORS: 0\n"
        "\x1b[1;31m * FAILURES: 1\x1b[0m\n"
    )


def test_a_program_that_could_not_run_is_named_at_the_end() -> None:
    could_not_run = Case(
        "rostest.runner.RosTest", "testfine", 0.1, Outcome.FAILURE, "AssertionError", "why\n"
    )

    text = runner_summary(Suite("rostest", (could_not_run,)), [])

    assert text.partition("\n\n")[2] == (
        "[testfine][failed]\n"
        "\n"
        "SUMMARY\n"
        "\x1b[1;31m * RESULT: FAIL\x1b[0m\n"
        " * TESTS: 0\n"
        " * ERRORS: 0\n"
        "\x1b[1;31m * FAILURES: 1\x1b[0m\n"
        "\n"
        "ERROR: The following tests failed to run:\n"
        " * testfine\n"
    )
