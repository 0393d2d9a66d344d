"""Threads that are reused for the next job."""

import gc
import threading
import weakref

import pytest

from pipros.basics.errors import Unreachable
from pipros.basics.interrupts import interrupt_main_thread
from pipros.net.in_parallel import in_parallel
from pipros.net.shared_workers import SharedWorkers
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


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_users_share_threads_and_room() -> None:
    workers, gate, done = SharedWorkers("shared", 4, 20), threading.Event(), list[str]()
    assert [workers.run("greedy", gate.wait) for _ in range(12)] == [True] * 10 + [False] * 2
    assert workers.run("failing", lambda: 1 / 0)
    assert workers.run("failing", done.append, "after a failure")
    assert not workers.run("large", done.append, "large", cost=9)
    assert workers.run("small", done.append, "small")
    wait_until(lambda: sorted(done) == ["after a failure", "small"])
    gate.set()
    wait_until(lambda: workers.run("large", done.append, "large", cost=10))
    wait_until(lambda: "large" in done)
    workers.close()


def test_jobs_of_a_user_with_one_thread_run_in_order() -> None:
    workers, gate, done = SharedWorkers("in order", 4, 40, each=1), threading.Event(), list[int]()
    workers.run("user", gate.wait)
    for number in range(9):
        workers.run("user", done.append, number)
    workers.run("other", done.append, -1)
    wait_until(lambda: done == [-1])
    gate.set()
    wait_until(lambda: len(done) == 10)
    assert done == [-1, *range(9)]
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


def test_jobs_beyond_the_limit_of_threads_follow_in_order_also_after_one_that_fails(monkeypatch) -> None:
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


# Concurrent calls to many peers: order, limit, errors and Ctrl-C.


def test_results_are_in_the_order_of_the_keys() -> None:
    first_may_end = threading.Event()

    def ask(key: int) -> int:
        if key == 0:
            assert first_may_end.wait(30)
        first_may_end.set()
        return key * 2

    assert list(in_parallel(range(3), ask, at_once=2).items()) == [(0, 0), (1, 2), (2, 4)]
    assert in_parallel([], ask, at_once=2) == {}


def test_concurrent_calls_are_limited() -> None:
    under_way, most = [0], [0]
    lock = threading.Lock()

    def ask(_: int) -> None:
        with lock:
            under_way[0] += 1
            most[0] = max(most[0], under_way[0])
        with lock:
            under_way[0] -= 1

    in_parallel(range(50), ask, at_once=3)
    assert most[0] <= 3


def test_an_error_ends_the_wait() -> None:
    def ask(key: str) -> None:
        raise Unreachable(f"node {key}", "http://127.0.0.1:1/", "it is silent")

    with pytest.raises(Unreachable, match="it is silent"):
        in_parallel(["/a", "/b"], ask, at_once=1)


def test_ctrl_c_ends_the_wait_and_drops_calls_that_have_not_started() -> None:
    asked: list[int] = []
    gate = threading.Event()

    def ask(key: int) -> None:
        asked.append(key)
        interrupt_main_thread()
        gate.wait()

    with pytest.raises(KeyboardInterrupt):
        in_parallel(range(9), ask, at_once=1)
    gate.set()
    wait_until(lambda: not [each for each in threading.enumerate() if each.name == "in parallel"])
    assert asked == [0]
