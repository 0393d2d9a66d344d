"""Tests of `tests.support.processes`: remaining processes and failures are detected."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes
from tests.support.waiting import wait_until

pytest_plugins = ["pytester"]


def test_waiting_returns_the_first_true_value() -> None:
    values = iter([0, "", "ready"])

    assert wait_until(lambda: next(values)) == "ready"


def test_waiting_says_what_it_waited_for_when_the_time_is_over() -> None:
    with pytest.raises(AssertionError, match=r"not within 0\.0 s: the moon"):
        wait_until(lambda: False, timeout_s=0.0, what="the moon")


def test_two_claims_never_get_the_same_port() -> None:
    claims = [ClaimedPort() for _ in range(20)]

    assert len({claim.number for claim in claims}) == len(claims)
    for claim in claims:
        claim.release()


def test_both_streams_and_the_exit_code_of_a_program_are_seen(processes: Processes) -> None:
    program = "import sys; print('out'); print('err', file=sys.stderr); sys.exit(3)"

    ended = processes.run(sys.executable, "-c", program)

    assert (ended.stdout, ended.stderr, ended.returncode) == (["out"], ["err"], 3)


def test_a_missing_line_is_reported_with_the_output(processes: Processes) -> None:
    program = processes.start(sys.executable, "-c", "print('something else')")

    with pytest.raises(AssertionError, match=r"(?s)ended without the line /hello/:\nsomething else"):
        program.wait_for("hello")


def test_ctrl_c_reaches_the_program(processes: Processes) -> None:
    waits = "import time\nprint('up', flush=True)\nwhile True: time.sleep(0.1)"
    program = processes.start(sys.executable, "-c", waits)
    program.wait_for("up")

    program.press_ctrl_c()

    assert program.wait() != 0
    assert "KeyboardInterrupt" in program.output


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks into /proc, which Linux has")
def test_a_process_that_outlives_its_parent_in_another_session_is_found_and_ended() -> None:
    parent = (
        "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import signal; signal.pause()'], "
        "start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)"
    )
    started = Processes({"PATH": "/usr/bin:/bin"})
    started.run(sys.executable, "-c", parent)
    wait_until(started.left, what="the orphan to be seen")

    with pytest.raises(AssertionError, match=r"left running:\n\d+: .*signal.pause"):
        started.assert_nothing_left(timeout_s=0.2)
    wait_until(lambda: not started.left(), what="the orphan to be gone")


def test_the_report_of_a_failure_shows_what_each_program_printed(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    pytester.makeconftest("from tests.support.project_conftest import *")
    pytester.makepyfile(
        """
        import sys

        def test_before(processes):
            processes.run(sys.executable, "-c", "print('of another test')")

        def test_fails(processes):
            processes.run(sys.executable, "-c", "print('all is well'); exit(3)")
            waits = "import signal; print('up', flush=True); signal.pause()"
            processes.start(sys.executable, "-c", waits).wait_for("up")
            assert False
        """
    )

    report = pytester.runpytest_subprocess("-p", "no:cacheprovider").stdout.str()

    assert re.search(r"- ended: .*\n +\d+\.\d\d all is well\n\(exit code 3\)\n", report)
    assert re.search(r"- running: .*\n +\d+\.\d\d up\n", report)
    assert "of another test" not in report
