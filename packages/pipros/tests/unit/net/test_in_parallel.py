"""Concurrent calls to many peers: order, limit, errors and Ctrl-C."""

from __future__ import annotations

import threading

import pytest

from pipros.basics.errors import Unreachable
from pipros.basics.interrupts import interrupt_main_thread
from pipros.net.in_parallel import in_parallel
from tests.support.waiting import wait_until


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
