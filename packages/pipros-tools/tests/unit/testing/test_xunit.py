"""Result files: written in genuine rosunit's form, read from rosunit, rostest and gtest."""

from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.summary import runner_summary
from pipros_tools.testing.xunit import UnreadableResults, format_suite, parse_suites

SUITE = Suite(
    name="unittest.suite.TestSuite",
    cases=(
        Case("__main__.TalkerTestCase", "test_talker_publishing", 1.11452),
        Case(
            "__main__.TalkerTestCase", "test_level", 0.0002, Outcome.FAILURE, "AssertionError", "1 != <2>\n"
        ),
        Case("__main__.TalkerTestCase", "test_type", 0.0, Outcome.ERROR, "KeyError", "'gone é'\n"),
    ),
    seconds=1.1152,
    stdout="said & done\n",
)


def test_a_file_has_the_form_that_genuine_rosunit_writes() -> None:
    assert format_suite(SUITE) == (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<testsuite errors="1" failures="1" name="unittest.suite.TestSuite" tests="3" time="1.115">'
        '<testcase classname="__main__.TalkerTestCase" name="test_talker_publishing" time="1.1145" />'
        '<testcase classname="__main__.TalkerTestCase" name="test_level" time="0.0002">'
        '<failure type="AssertionError">1 != &lt;2&gt;\n</failure></testcase>'
        '<testcase classname="__main__.TalkerTestCase" name="test_type" time="0.0000">'
        "<error type=\"KeyError\">'gone é'\n</error></testcase>"
        "<system-out>&lt;![CDATA[\nsaid &amp; done\n\n]]&gt;</system-out>"
        "<system-err>&lt;![CDATA[\n\n]]&gt;</system-err></testsuite>"
    )


def test_escape_sequences_in_output_are_written_as_text_in_xml() -> None:
    text = format_suite(Suite("s", stdout="\x1b[32mok\x1b[0m"))

    assert "&amp;#x001B;[32mok&amp;#x001B;[0m" in text


@given(st.text(), st.text(), st.text())
def test_arbitrary_text_produces_valid_xml(name: str, message: str, printed: str) -> None:
    case = Case("c", name, 0.0, Outcome.FAILURE, "E", message)

    root = ElementTree.fromstring(format_suite(Suite("s", (case,), stdout=printed)).encode())  # noqa: S314

    assert root.attrib["failures"] == "1"


def test_written_results_are_read_back() -> None:
    (read,) = parse_suites(format_suite(SUITE).encode(), "a.xml")

    assert [(case.name, case.outcome, case.text) for case in read.cases] == [
        (case.name, case.outcome, case.text) for case in SUITE.cases
    ]
    assert (read.errors, read.failures, read.stdout) == (1, 1, "said & done\n")


def test_a_gtest_file_gives_a_suite_for_each_of_its_test_cases() -> None:
    text = b"""<?xml version="1.0" encoding="UTF-8"?>
        <testsuites tests="2" failures="1" errors="0" name="AllTests">
          <testsuite name="Levels" tests="1" time="0.5">
            <testcase name="fits" classname="Levels" time="0.5"/>
          </testsuite>
          <testsuite name="Topics" tests="1">
            <testcase name="exists" classname="Topics" time="odd">
              <failure message="Expected: true" type="">a.cpp:3
Expected: true</failure>
              <failure message="second" type=""/>
            </testcase>
          </testsuite>
        </testsuites>"""

    levels, topics = parse_suites(text, "gtest.xml")

    assert (levels.name, levels.passed, levels.seconds) == ("Levels", True, 0.5)
    assert topics.cases[0].outcome is Outcome.FAILURE
    assert topics.cases[0].text == "a.cpp:3\nExpected: true\nsecond"


@pytest.mark.parametrize(("content", "reason"), [
    (b"", "not XML"), (b"<testsuite", "not XML"), (b"<!DOCTYPE t [<!ENTITY a 'b'>]><testsuite/>", "DOCTYPE"),
    (b"<html/>", "r.xml:1: test results must start with <testsuite> or <testsuites>, got <html>"),
])  # fmt: skip
def test_a_file_of_another_kind_is_refused_with_its_name(content: bytes, reason: str) -> None:
    with pytest.raises(UnreadableResults, match=r"r\.xml") as caught:
        parse_suites(content, "r.xml")

    assert reason in str(caught.value)


# The summary of rostest, word for word and colour for colour.


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
