"""The turns of a worker: event loops, links and jobs in one thread."""

from __future__ import annotations

import asyncio
import itertools
import sys
import threading
import time

import pytest

from pipros_tab.network import Network
from pipros_tab.sockets import TabSelector, socketpair
from pipros_tab.tab_socket import TabSocket
from pipros_tab.turns import DEEPEST, END_S, WorkerTurns, distinct_ns
from tests.support.tab_hub import MemoryPort, Switch


@pytest.fixture
def turns(monkeypatch: pytest.MonkeyPatch) -> WorkerTurns:
    network = Network(MemoryPort(Switch()))
    turns = WorkerTurns(network)
    monkeypatch.setattr(TabSocket, "network", network, raising=False)
    monkeypatch.setattr(TabSocket, "wait", staticmethod(turns.wait_for_network), raising=False)
    monkeypatch.setattr(TabSocket, "by_descriptor", {})
    monkeypatch.setattr("socket.socketpair", socketpair)
    return turns


def never() -> bool:
    return False


def test_jobs_run_in_order_where_the_thread_waits(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(done.append, 1)
    turns.later(done.append, 2)
    assert done == []
    assert turns.wait(lambda: len(done) == 2, 5.0)
    assert done == [1, 2]


def test_an_exit_in_a_job_ends_this_job_alone(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(sys.exit)
    turns.later(done.append, 1)
    assert turns.wait(lambda: bool(done), 5.0)


def test_a_wait_without_work_ends_in_time(turns: WorkerTurns) -> None:
    before = time.monotonic()
    assert not turns.wait(never, 0.05)
    assert time.monotonic() - before >= 0.05


def test_a_wait_with_endless_work_ends(turns: WorkerTurns) -> None:
    def again() -> None:
        turns.later(again)

    again()
    assert not turns.wait(never, 0.01)


def test_a_job_that_waits_lets_others_run(turns: WorkerTurns) -> None:
    done: list[str] = []

    def first() -> None:
        turns.wait(lambda: "second" in done, 5.0)
        done.append("first")

    turns.later(first)
    turns.later(done.append, "second")
    turns.wait(lambda: len(done) == 2, 5.0)
    assert done == ["second", "first"]


def test_jobs_are_nested_to_a_limited_depth(turns: WorkerTurns) -> None:
    depths: list[int] = []

    def nest() -> None:
        depths.append(len(depths))
        turns.later(nest)
        turns.wait(never, 0.001)

    turns.later(nest)
    turns.wait(lambda: len(depths) >= DEEPEST, 5.0)
    assert len(depths) == DEEPEST


def test_the_last_job_runs_where_no_job_waits_after_a_moment(turns: WorkerTurns) -> None:
    done: list[object] = []

    def end() -> None:
        turns.sleep(0.001)  # it may wait itself
        done.append("the last")

    def loop_that_catches_errors() -> None:
        turns.at_last(end)
        while True:
            try:
                turns.wait(never, None)
            except Exception as error:
                done.append(error)

    def nested() -> None:
        turns.later(loop_that_catches_errors)
        turns.wait(lambda: "the last" in done, 30.0)
        done.append("not reached")

    turns.later(nested)
    assert turns.wait(lambda: bool(done), 5.0)
    assert done == ["the last"]


def test_jobs_that_end_by_themselves_are_not_ended(
    turns: WorkerTurns, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros_tab.turns.END_S", 3.0)
    done: list[str] = []

    def job() -> None:
        turns.at_last(done.append, "the last")
        turns.sleep(0.01)
        done.append("job")

    turns.later(job)
    assert turns.wait(lambda: len(done) == 2, 30.0)
    assert done == ["job", "the last"]


def test_jobs_that_are_called_while_a_node_ends_end_too(turns: WorkerTurns) -> None:
    done: list[str] = []

    def end() -> None:
        turns.later(turns.sleep, 30.0)
        turns.later(done.append, "another")
        turns.sleep(2 * END_S)
        done.append("end")

    turns.later(turns.while_ending, end)
    turns.later(turns.sleep, 2 * END_S)
    assert turns.wait(lambda: len(done) == 2, 5.0)
    assert done == ["another", "end"]
    turns.later(lambda: (turns.sleep(2 * END_S), done.append("after")))
    assert turns.wait(lambda: len(done) == 3, 5.0)


def test_an_event_loop_runs_where_the_thread_waits(turns: WorkerTurns) -> None:
    loop = asyncio.SelectorEventLoop(TabSelector())
    turns.drive(loop)

    async def work() -> str:
        await asyncio.sleep(0.01)
        return "done"

    task = loop.create_task(work())
    assert turns.wait(task.done, 5.0)
    assert task.result() == "done"
    loop.close()
    assert not turns.wait(never, 0.0)


def test_a_wait_for_the_network_runs_no_jobs(turns: WorkerTurns) -> None:
    done: list[int] = []
    turns.later(done.append, 1)
    assert not turns.wait_for_network(never, 0.01)
    assert done == []


def test_a_link_is_called_when_its_socket_can_be_read(turns: WorkerTurns) -> None:
    reading, writing = socketpair()
    received: list[bytes] = []
    calls: list[int] = []

    def read() -> bool:
        calls.append(1)
        if reading.is_readable:
            received.append(reading.recv(1))
        return len(calls) < 2

    turns.read(reading, read)
    turns.wait(never, 0.01)
    assert len(calls) == 2  # once more, because it had more to do
    writing.send(b"x")
    assert turns.wait(lambda: bool(received), 5.0)
    reading.close()
    writing.close()
    turns.wait(never, 0.01)
    assert received == [b"x"]


def test_a_timer_is_repeated_until_it_returns_none(turns: WorkerTurns) -> None:
    times: list[float] = []

    def tick() -> float | None:
        times.append(time.monotonic())
        return 0.02 if len(times) < 3 else None

    turns.repeat(tick)
    assert not turns.wait(never, 0.2)
    assert len(times) == 3
    assert times[2] - times[0] >= 0.04


def test_publishing_takes_a_turn(turns: WorkerTurns) -> None:
    done: list[str] = []
    turns.later(done.append, "callback")
    turns.publishing(done.append)("message")
    assert done == ["message", "callback"]


def test_jobs_run_while_an_event_is_awaited(turns: WorkerTurns, monkeypatch: pytest.MonkeyPatch) -> None:
    def wait(condition: threading.Condition, timeout: float | None = None) -> bool:
        return turns.wait_for_condition(condition, timeout)

    monkeypatch.setattr(threading.Condition, "wait", wait)
    event = threading.Event()
    assert not event.wait(0.01)
    turns.later(event.set)
    assert event.wait(5.0)


def test_the_times_of_a_coarse_clock_differ() -> None:
    shown = iter((5_000_000, 5_000_000, 5_000_000, 6_000_000, 4_000_000))
    times = list(itertools.islice(distinct_ns(lambda: next(shown)), 5))
    assert times == [5_000_000, 5_001_000, 5_002_000, 6_000_000, 6_001_000]
