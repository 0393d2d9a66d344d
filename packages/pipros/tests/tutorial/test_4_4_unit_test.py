"""Section 4.4 of the case study: the test of the talker, run by rosrun in a third terminal."""

import re

from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import PASSED_TEST, SAID, TALKER, TEST


def test_it_passes_while_the_talker_runs(ros: RosSystem, core: Terminal) -> None:
    talker, test = ros.pipros.open_terminal(), ros.pipros.open_terminal()
    talker.type(TALKER)
    talker.wait_for(SAID)

    assert test.run(TEST) == (0, f"[ROSUNIT] Outputting test results to {_result_file(ros)}\n{PASSED_TEST}")
    assert re.fullmatch(
        r'<\?xml version="1\.0" encoding="utf-8"\?>\n'
        r'<testsuite errors="0" failures="0" name="unittest\.suite\.TestSuite" tests="1" time="[\d.]+">'
        r'<testcase classname="__main__\.TalkerTestCase" name="test_talker_publishing" time="[\d.]+" />'
        r"<system-out>&lt;!\[CDATA\[\n\n\]\]&gt;</system-out>"
        r"<system-err>&lt;!\[CDATA\[\n\n\]\]&gt;</system-err></testsuite>",
        _read(ros),
    )
    _end(talker)


def test_it_fails_with_a_clear_report_when_no_talker_runs(ros: RosSystem, core: Terminal) -> None:
    code, output = ros.pipros.open_terminal().run(TEST)

    assert code == 1
    assert "[Testcase: test_talker_publishing] ... FAILURE!\nFAILURE: False is not true\n" in output
    assert re.search(
        r'  File ".+/test/test_talker\.py", line 22, in test_talker_publishing\n'
        r"    self\.assertTrue\(self\.talker_ok\)\n",
        output,
    )
    assert output.endswith(
        "SUMMARY:\n * RESULT: FAIL\n * TESTS: 1\n * ERRORS: 0 []\n * FAILURES: 1 [test_talker_publishing]\n\n"
    )
    assert '<failure type="AssertionError">False is not true\n' in _read(ros)


def test_text_gives_the_report_of_unittest_and_no_file(ros: RosSystem, core: Terminal) -> None:
    talker = ros.pipros.open_terminal()
    talker.type(TALKER)
    talker.wait_for(SAID)

    code, output = ros.pipros.open_terminal().run(f"{TEST} --text")

    assert code == 0
    output = re.sub(r"\x1b\[\d*m", "", output)  # Python 3.14 colours it
    assert re.search(r"test_talker_publishing \(.*\) \.\.\. (.*\n)*ok\n", output)
    assert "Ran 1 test in" in output
    assert " * RESULT: SUCCESS" in output
    assert not (ros.home / ".ros/test_results").exists()
    _end(talker)


def _end(talker: Terminal) -> None:
    """Press Ctrl-C: where Windows is simulated, a closed terminal does not end rosrun with its program."""
    talker.press_ctrl_c()
    talker.wait_for_prompt()


def _result_file(ros: RosSystem) -> str:
    return f"{ros.home}/.ros/test_results/composiv_tryouts/rosunit-composiv_talker.xml"


def _read(ros: RosSystem) -> str:
    with open(_result_file(ros), encoding="utf-8") as file:
        return file.read()
