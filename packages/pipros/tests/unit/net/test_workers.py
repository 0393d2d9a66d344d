"""Threads that are reused for the next job."""

import gc
import threading
import weakref

import pytest

from pipros.net.workers import Workers
from tests.support.waiting import wait_until


def threads_named(name: str) -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == name]


def test_a_blocking_job_does_not_delay_others() -> None:
    workers, gate, done = Workers("blocked"), threading.Event(), threading.Event()
    workers.run(gate.wait)
    workers.run(done.set)
    assert done.wait(30)
    gate.set()
    workers.close()


class Argument:
    """A value that a job is given."""


def test_an_idle_thread_refers_to_none_of_its_jobs() -> None:
    workers, used = Workers("idle", limit=1), list[Argument | None]()
    arguments = [Argument() for _ in range(2)]
    references = [weakref.ref(each) for each in arguments]
    for each in arguments:
        workers.run(used.append, each)
    wait_until(lambda: len(used) == 2)
    used.clear()
    arguments.clear()
    del each
    done = threading.Event()
    workers.run(done.set)  # when the only thread has begun this, it has finished the jobs before
    assert done.wait(30)
    gc.collect()

    assert [reference() for reference in references] == [None, None]
    assert threads_named("idle")
    workers.close()


def test_closing_during_jobs_leaves_no_thread() -> None:
    workers, gate = Workers("closed"), threading.Event()
    for _ in range(3):
        workers.run(gate.wait)
    workers.close()
    assert len(threads_named("closed")) == 3
    gate.set()
    wait_until(lambda: not threads_named("closed"), what="the end of the threads")


def test_jobs_beyond_the_limit_of_threads_follow_in_order_also_after_one_that_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    failures: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", failures.append)
    workers, gate, done = Workers("limited", limit=1, kept_idle=0), threading.Event(), list[int]()

    def fail() -> None:
        raise ValueError("a bug of the job")

    workers.run(gate.wait)
    workers.run(fail)
    for number in range(3):
        workers.run(done.append, number)
    assert len(threads_named("limited")) == 1
    gate.set()
    wait_until(lambda: not threads_named("limited"), what="the end of the thread")
    assert done == [0, 1, 2]
    assert [str(failure.exc_value) for failure in failures] == ["a bug of the job"]
