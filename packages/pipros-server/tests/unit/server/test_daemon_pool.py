"""Functions of several browsers run in turn, in a few threads."""

from __future__ import annotations

import contextvars
import threading
from concurrent.futures import Future

from pipros_server.browser_share import Browser, has_share, set_current_browser
from pipros_server.daemon_pool import DaemonPool


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
