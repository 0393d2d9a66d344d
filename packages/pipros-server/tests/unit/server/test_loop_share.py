"""A client that makes the server compute much leaves the event loop to others."""

import asyncio
import contextlib
import contextvars
import threading
import time
from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from pipros_server import loop_share
from pipros_server.browser_share import Browser, has_share, set_current_browser
from pipros_server.daemon_pool import DaemonPool
from pipros_server.loop_share import BURST_S, SHARE, LoopShare, LoopShares

STEP_S = 0.02


def test_many_busy_views_of_a_browser_take_few_steps_while_another_takes_one() -> None:
    async def scenario() -> list[int]:
        share, steps = LoopShare(LoopShares()), 0

        async def view() -> None:
            nonlocal steps
            while True:
                time.sleep(STEP_S)
                steps += 1
                await asyncio.sleep(0)

        views = [asyncio.create_task(share.run(view)) for _ in range(30)]
        counts = []
        for _ in range(10):
            before = steps
            await asyncio.sleep(0.001)
            counts.append(steps - before)
        for each in views:
            each.cancel()
        await asyncio.gather(*views, return_exceptions=True)
        return counts

    assert max(asyncio.run(scenario())) <= 2 * BURST_S / STEP_S / SHARE


def test_a_cancelled_coroutine_does_not_rest_and_its_exceptions_pass() -> None:
    async def scenario() -> list[str]:
        share, ends = LoopShare(LoopShares()), list[str]()

        async def view() -> None:
            for _ in range(20):
                time.sleep(STEP_S)
            try:
                await asyncio.sleep(3600)
            except asyncio.CancelledError:
                ends.append("cancelled")
                raise

        async def failing() -> None:
            await asyncio.sleep(0)
            raise ConnectionError

        with pytest.raises(ConnectionError):
            await share.run(failing)
        task = asyncio.create_task(share.run(view))
        await asyncio.sleep(0.001)
        task.cancel()  # its rest would be as long as its work
        with contextlib.suppress(asyncio.CancelledError):
            await task
        return ends

    assert asyncio.run(scenario()) == ["cancelled"]


def test_several_busy_browsers_leave_half_of_the_loop_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0
    pass_on = asyncio.sleep

    async def sleep(duration_s: float) -> None:
        end_s = now_s + duration_s
        while now_s < end_s:
            await pass_on(0)

    monkeypatch.setattr(loop_share, "time", SimpleNamespace(monotonic=lambda: now_s))
    monkeypatch.setattr(loop_share, "asyncio", SimpleNamespace(sleep=sleep, Lock=asyncio.Lock))

    async def scenario() -> list[float]:
        nonlocal now_s
        shares, worked_s = LoopShares(), [0.0] * 4

        async def view(number: int) -> None:
            nonlocal now_s
            while True:
                now_s += STEP_S
                worked_s[number] += STEP_S
                await pass_on(0)

        browsers = [LoopShare(shares) for _ in worked_s]
        views = [asyncio.create_task(each.run(view, number)) for number, each in enumerate(browsers)]
        while now_s < 20.0:
            now_s += STEP_S / 20  # the others do little
            await pass_on(0)
        for each in views:
            each.cancel()
        await asyncio.gather(*views, return_exceptions=True)
        assert shares.busy_now() == {*browsers}
        for browser in browsers[1:]:
            browser.close()
            browser.note(1.0)  # the end of a coroutine
        assert shares.busy_now() == {browsers[0]}
        now_s += 60.0
        assert not shares.busy_now()
        return worked_s

    worked_s = asyncio.run(scenario())
    assert sum(worked_s) <= 1.1 * SHARE * 20.0
    assert max(worked_s) <= 1.2 * min(worked_s)


def test_a_coroutine_that_never_waits_gives_others_their_turn() -> None:
    async def scenario() -> int:
        share, handled = LoopShare(LoopShares()), 0

        async def client() -> None:
            nonlocal handled
            while True:
                time.sleep(STEP_S / 10)
                handled += 1
                await share.end_long_step()

        task = asyncio.create_task(share.run(client))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return handled

    assert 1 <= asyncio.run(scenario()) <= 2


def run_threads(
    monkeypatch: pytest.MonkeyPatch, count: int, seconds: float, step_s: float = 0.01
) -> list[float]:
    """Return the processor time that threads of each of some busy clients of one server get."""
    now_s = 0.0
    monkeypatch.setattr(loop_share, "time", SimpleNamespace(monotonic=lambda: now_s))
    shares = LoopShares()
    clients, worked = [LoopShare(shares) for _ in range(count)], [0.0] * count
    while now_s < seconds:
        began_s = now_s
        for number, client in enumerate(clients):
            if client.pause_s() <= 0:
                now_s += step_s
                worked[number] += step_s
                client.note_threads(worked[number])
        now_s += step_s / (2 if now_s == began_s else 10)
    return worked


def test_threads_of_a_client_that_is_alone_may_use_a_whole_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    [worked] = run_threads(monkeypatch, 1, 20)
    assert worked > 18


@pytest.mark.parametrize("count", [2, 5, 20])
def test_threads_of_busy_clients_share_a_part_of_the_processor_equally(
    monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    worked = run_threads(monkeypatch, count, 60)
    assert sum(worked) == pytest.approx(60 * SHARE, rel=0.2)
    assert max(worked) < 1.2 * min(worked)


def test_a_client_with_little_work_is_not_delayed_by_busy_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0
    monkeypatch.setattr(loop_share, "time", SimpleNamespace(monotonic=lambda: now_s))
    shares = LoopShares()
    busy, other = LoopShare(shares), LoopShare(shares)
    for number in range(500):
        now_s += 0.02
        busy.note(0.02)
        other.note_threads(0.001 * number)
        assert other.pause_s() <= 0


# Functions of several browsers run in turn, in a few threads.


def test_a_browser_with_many_functions_does_not_delay_another_one() -> None:
    pool, is_free, order = DaemonPool("test", 1), threading.Event(), list[str]()
    first, second = contextvars.copy_context(), contextvars.copy_context()
    first.run(set_current_browser)
    second.run(set_current_browser)

    def start(context: contextvars.Context, name: str) -> Future[None]:
        return context.run(pool.start, order.append, name)

    blocking = first.run(pool.start, is_free.wait, 60.0)
    many = [start(first, f"first {number}") for number in range(5)]
    many[0].cancel()
    one = start(second, "second")
    is_free.set()

    for each in (blocking, one, *many[1:]):
        each.result(60.0)
    assert order == ["second", "first 1", "first 2", "first 3", "first 4"]


def test_a_browser_with_slow_functions_leaves_threads_to_another_one() -> None:
    pool, is_free = DaemonPool("test", 4), threading.Event()
    first, second = contextvars.copy_context(), contextvars.copy_context()
    first.run(set_current_browser)
    second.run(set_current_browser)

    slow = [first.run(pool.start, is_free.wait, 60.0) for _ in range(8)]
    assert second.run(pool.start, is_free.is_set).result(30.0) is False
    is_free.set()

    assert [each.result(60.0) for each in slow] == [True] * 8


def test_what_starts_outside_of_browsers_may_use_all_threads() -> None:
    pool, all_run = DaemonPool("test", 4), threading.Barrier(5)

    waiting = [pool.start(all_run.wait, 60.0) for _ in range(4)]
    all_run.wait(60.0)

    assert len({each.result(60.0) for each in waiting}) == 4


def test_greedy_browsers_leave_a_share_for_the_next() -> None:
    holders: list[Browser | None] = []
    counts = []
    for browser in [Browser() for _ in range(6)] + [None]:
        while has_share(browser, holders, 100):
            holders.append(browser)
        counts.append(holders.count(browser))
    assert counts == [50, 25, 13, 6, 3, 2, 1]
