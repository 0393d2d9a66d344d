"""The goals of an action server, by ID."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Generic, TypeVar

_Goal = TypeVar("_Goal")


def meant_by(
    goals: Iterable[_Goal], named: _Goal | None, goal_id: str, stamp: int, stamp_of: Callable[[_Goal], int]
) -> list[_Goal]:
    """Return the goals that a cancellation request selects, by the rules in actionlib_msgs/GoalID.

    An ID selects one goal, and a timestamp (ns) selects all goals up to that time. If both are given, the
    goals of both selections are returned. An empty ID with the timestamp 0 selects all goals.

    Args:
        named: the goal with the ID `goal_id`, if there is one.
        stamp_of: function that returns a goal's timestamp (ns).
    """
    if goal_id and not stamp:
        return [] if named is None else [named]
    return [goal for goal in goals if not stamp or goal is named or stamp_of(goal) <= stamp]


def append_goal(goals: list[_Goal], goal: _Goal, limit: int, has_ended: Callable[[_Goal], bool]) -> bool:
    """Append a goal to a list of at most `limit` goals. If the list is full, replace the oldest ended goal.

    Return False if the list is full and no goal has ended.
    """
    if len(goals) >= limit:
        ended = next((index for index, each in enumerate(goals) if has_ended(each)), None)
        if ended is None:
            return False
        del goals[ended]
    goals.append(goal)
    return True


class GoalTable(Generic[_Goal]):
    """Goals in order of arrival, up to a limit. Not thread-safe.

    When the table is full, a new goal replaces the oldest goal that has ended. If no goal has ended, the new
    goal is refused.
    """

    def __init__(self, limit: int, id_characters: int, has_ended: Callable[[_Goal], bool]) -> None:
        """Create an empty table.

        Args:
            limit: maximum number of goals.
            id_characters: maximum length of an ID.
            has_ended: function that returns whether a goal has ended and is kept only for its status.
        """
        self._limit = limit
        self._id_characters = id_characters
        self._has_ended = has_ended
        self._goals: dict[str, _Goal] = {}

    def __len__(self) -> int:
        return len(self._goals)

    def __iter__(self) -> Iterator[_Goal]:
        return iter(list(self._goals.values()))

    def find(self, goal_id: str) -> _Goal | None:
        """Return the goal with the given ID, or None."""
        return self._goals.get(goal_id)

    def meant_by(self, goal_id: str, stamp: int, stamp_of: Callable[[_Goal], int]) -> list[_Goal]:
        """Return the goals that a cancellation request selects; see the function `meant_by`."""
        return meant_by(self, self.find(goal_id), goal_id, stamp, stamp_of)

    def add(self, goal_id: str, goal: _Goal) -> bool:
        """Add a goal. Return False if the table is full and no goal has ended, or if the ID is too long."""
        if len(goal_id) > self._id_characters:
            return False
        if goal_id not in self._goals and len(self._goals) >= self._limit:
            ended = next((key for key, each in self._goals.items() if self._has_ended(each)), None)
            if ended is None:
                return False
            del self._goals[ended]
        self._goals[goal_id] = goal
        return True

    def keep(self, is_kept: Callable[[_Goal], bool]) -> None:
        """Drop the goals for which `is_kept` returns False."""
        self._goals = {key: goal for key, goal in self._goals.items() if is_kept(goal)}
