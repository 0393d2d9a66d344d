"""A callback added to a latched topic receives the last message first, and every later one."""

from __future__ import annotations

import threading

from pipros.node.latch import LatchedFirst


def test_latched_messages_are_delivered_first() -> None:
    got: list[int] = []
    first = LatchedFirst([1, 2], got.append)
    first(3)
    first.give()
    first(4)
    assert got == [1, 2, 3, 4]


def test_a_message_that_arrives_during_the_latched_one_waits_for_it() -> None:
    got: list[int] = []
    is_within, may_go_on = threading.Event(), threading.Event()

    def call_back(message: int) -> None:
        is_within.set()
        assert may_go_on.wait(30)
        got.append(message)

    first = LatchedFirst([1], call_back)
    giver = threading.Thread(target=first.give)
    giver.start()
    assert is_within.wait(30)
    first(2)
    assert got == []
    may_go_on.set()
    giver.join()
    assert got == [1, 2]


def test_a_callback_may_trigger_the_next_message() -> None:
    got: list[int] = []

    def call_back(message: int) -> None:
        got.append(message)
        if message < 3:
            first(message + 1)

    first = LatchedFirst([1], call_back)
    first.give()
    assert got == [1, 2, 3]
