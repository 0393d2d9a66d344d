"""A stopped run of tests leaves no process behind; see `tests.support.leave_nothing`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environments import PACKAGES, REPOSITORY
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs Linux's subreapers")

# A program of a test: in its own session, with its own environment, and it ignores SIGTERM.
STUBBORN = "import signal, sys, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(1000)"
STARTS_PROGRAMS = f"""
import subprocess, sys, time
for words in (["sleep", "1000", sys.argv[1]], [sys.executable, "-c", {STUBBORN!r}, sys.argv[1]]):
    subprocess.Popen(words, start_new_session=True, env={{}}, stderr=subprocess.DEVNULL)
if sys.argv[2] == "wait":
    time.sleep(1000)
sys.exit(3)
"""


@pytest.fixture
def token() -> str:
    return str(uuid.uuid4())


def running(token: str) -> list[str]:
    """Return the command lines of the processes that were started with the token."""
    lines = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            line = (folder / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if token in line:
            lines.append(line)
    return lines


@pytest.fixture
def started(token: str, request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[bytes]]:
    words = [sys.executable, "-c", STARTS_PROGRAMS, token, getattr(request, "param", "wait")]
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.support.leave_nothing", *words],
        cwd=PACKAGES[0],
        start_new_session=True,
    )
    yield process
    process.kill()
    process.wait()


@pytest.mark.parametrize("sends", [os.kill, os.killpg], ids=["process", "group"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_stopped_run_leaves_nothing(
    started: subprocess.Popen[bytes], token: str, number: int, sends: object
) -> None:
    wait_until(lambda: sum("sleep" in line for line in running(token)) >= 3)

    sends(started.pid, number)  # type: ignore[operator]

    assert started.wait(60) in (1, 128 + number)
    assert running(token) == []


@pytest.mark.parametrize("started", ["end"], indirect=True)
def test_the_exit_code_is_that_of_the_command(started: subprocess.Popen[bytes], token: str) -> None:
    assert started.wait(60) == 3
    assert running(token) == []


def test_script_test_leaves_nothing() -> None:
    assert "exec .venv/bin/python -m tests.support.leave_nothing " in (REPOSITORY / "script/test").read_text()
