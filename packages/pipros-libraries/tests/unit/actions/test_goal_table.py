"""The goals of an action server: found by id, and bounded."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from pipros_libraries.actions.goal_table import GoalTable, append_goal


@dataclass
class Goal:
    name: str
    has_ended: bool = False


@pytest.fixture
def table() -> GoalTable[Goal]:
    made: GoalTable[Goal] = GoalTable(3, 10, lambda goal: goal.has_ended)
    for name in "abc":
        assert made.add(name, Goal(name))
    return made


def names(table: GoalTable[Goal]) -> str:
    return "".join(goal.name for goal in table)


def test_a_full_table_refuses_goals_while_none_has_ended(table: GoalTable[Goal]) -> None:
    assert not table.add("d", Goal("d"))
    assert (names(table), table.find("d")) == ("abc", None)


def test_a_new_goal_replaces_the_oldest_that_has_ended(table: GoalTable[Goal]) -> None:
    for name in "cb":
        goal = table.find(name)
        assert goal is not None
        goal.has_ended = True

    assert table.add("d", Goal("d"))
    assert names(table) == "acd"


def test_a_goal_that_is_added_again_replaces_only_itself(table: GoalTable[Goal]) -> None:
    for goal in table:
        goal.has_ended = True

    assert table.add("b", Goal("new b "))
    assert names(table) == "anew b c"


def test_discarded_goals_make_room(table: GoalTable[Goal]) -> None:
    table.keep(lambda goal: goal.name == "b")
    assert table.add("d", Goal("d"))
    assert names(table) == "bd"


def test_long_ids_are_refused(table: GoalTable[Goal]) -> None:
    table.keep(lambda _: False)
    assert not table.add("x" * 11, Goal("x"))
    assert table.add("x" * 10, Goal("x"))


@pytest.mark.parametrize(
    ("goal_id", "stamp", "expected"),
    [("", 0, "abc"), ("b", 0, "b"), ("x", 0, ""), ("", 98, "ab"), ("c", 97, "ac"), ("x", 97, "a")],
)
def test_a_cancellation_means_a_goal_or_those_up_to_a_stamp(
    table: GoalTable[Goal], goal_id: str, stamp: int, expected: str
) -> None:
    meant = table.meant_by(goal_id, stamp, lambda goal: ord(goal.name))

    assert "".join(goal.name for goal in meant) == expected


def appended(ended: str, limit: int) -> str:
    """Goals after the goal d was appended to a, b and c; names in `ended` are goals that have ended."""
    goals = list("abc")
    was_appended = append_goal(goals, "d", limit, lambda goal: goal in ended)
    assert was_appended is ("d" in goals)
    return "".join(goals)


def test_a_list_with_room_keeps_all_goals() -> None:
    assert appended(ended="a", limit=4) == "abcd"


def test_in_a_full_list_a_goal_replaces_the_oldest_that_has_ended_or_is_refused() -> None:
    assert appended(ended="cb", limit=3) == "acd"
    assert appended(ended="", limit=3) == "abc"
