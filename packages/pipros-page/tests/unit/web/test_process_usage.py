"""Resource usage from `/proc`."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pipros_page.process_usage import usage_of
from tests.support.processes import Processes
from tests.support.waiting import wait_until

PROGRAM = """
import sys, threading
print("one thread", flush=True)
sys.stdin.readline()
threading.Thread(target=threading.Event().wait, daemon=True).start()
print("two threads", flush=True)
sys.stdin.readline()
while True:
    sum(range(100_000))
"""


@pytest.mark.needs("/proc")
def test_a_process_has_memory_threads_and_processor_time(processes: Processes) -> None:
    # In the process of the tests, threads of earlier tests may end at any time.
    process = processes.start(sys.executable, "-I", "-S", "-c", PROGRAM, stdin=subprocess.PIPE)
    process.wait_for("one thread")
    before = usage_of(process.pid)
    assert before is not None
    assert before.memory_bytes > 1_000_000
    assert before.threads == 1
    assert before.files is not None
    process.write_line("")
    process.wait_for("two threads")
    more = usage_of(process.pid)
    assert more is not None
    assert (more.threads, more.start) == (2, before.start)
    process.write_line("")
    wait_until(lambda: _processor_s(process.pid) > before.processor_s, what="processor time")


def _processor_s(pid: int) -> float:
    usage = usage_of(pid)
    return usage.processor_s if usage else 0.0


def test_a_process_that_ended_has_no_usage() -> None:
    process = subprocess.Popen([sys.executable, "-c", "pass"])
    wait_until(lambda: usage_of(process.pid) is None, 30, "the end of the process")
    process.wait()
    assert usage_of(process.pid) is None
