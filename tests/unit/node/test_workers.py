"""Threads that are kept for the next job."""

import threading

from pipros.node.workers import Workers
from tests.support.waiting import wait_until


def threads_named(name: str) -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == name]


def test_a_job_that_blocks_delays_no_other() -> None:
    workers, gate, done = Workers("blocked"), threading.Event(), threading.Event()
    workers.run(gate.wait)
    workers.run(done.set)
    assert done.wait(10)
    gate.set()
    workers.close()


def test_none_is_left_when_it_closes_while_jobs_are_under_way() -> None:
    workers, gate = Workers("closed"), threading.Event()
    for _ in range(3):
        workers.run(gate.wait)
    workers.close()
    assert len(threads_named("closed")) == 3
    gate.set()
    wait_until(lambda: not threads_named("closed"), what="the end of the threads")
