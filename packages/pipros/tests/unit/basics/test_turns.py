"""Queue that serves its users in turns."""

from __future__ import annotations

import pytest

from pipros.basics.turns import Turns


def test_a_user_with_many_items_does_not_delay_another() -> None:
    turns: Turns[str, int] = Turns()
    for number in range(1_000):
        turns.put("greedy", number)
    turns.put("modest", 1)
    turns.put("modest", 2)
    assert [turns.pop() for _ in range(5)] == [
        ("greedy", 0),
        ("modest", 1),
        ("greedy", 1),
        ("modest", 2),
        ("greedy", 2),
    ]
    assert len(turns) == turns.waiting("greedy") == 997
    assert turns.waiting("modest") == 0


def test_the_items_of_a_user_that_has_left_are_removed_at_once() -> None:
    turns: Turns[str, int] = Turns()
    for number in range(3):
        turns.put("a", number)
    turns.put("b", 9)
    assert turns.forget("a") == [0, 1, 2]
    assert turns.forget("a") == []
    assert len(turns) == 1
    assert turns.pop() == ("b", 9)
    with pytest.raises(IndexError, match="empty"):
        turns.pop()


def test_a_user_that_returns_waits_for_the_others() -> None:
    turns: Turns[str, int] = Turns()
    turns.put("a", 1)
    turns.put("b", 2)
    assert turns.pop() == ("a", 1)
    turns.put("a", 3)
    assert [turns.pop(), turns.pop()] == [("b", 2), ("a", 3)]
