"""Resource usage from `/proc`."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

from pipros.web.process_usage import usage_of
from tests.support.waiting import wait_until


def test_a_process_has_memory_threads_and_processor_time() -> None:
    before = usage_of(os.getpid())
    assert before is not None
    assert before.memory_bytes > 1_000_000
    assert before.threads == len(os.listdir("/proc/self/task"))
    assert before.files is not None
    release = threading.Event()
    thread = threading.Thread(target=release.wait, args=(30,))
    thread.start()
    more = usage_of(os.getpid())
    release.set()
    thread.join()
    assert more is not None
    assert (more.threads, more.start) == (before.threads + 1, before.start)
    wait_until(lambda: sum(range(100_000)) and _processor_s() > before.processor_s, 30, "processor time")


def _processor_s() -> float:
    usage = usage_of(os.getpid())
    return usage.processor_s if usage else 0.0


def test_a_process_that_ended_has_no_usage() -> None:
    process = subprocess.Popen([sys.executable, "-c", "pass"])
    wait_until(lambda: usage_of(process.pid) is None, 30, "the end of the process")
    process.wait()
    assert usage_of(process.pid) is None
