"""The goals of an action server, by id."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

_Goal = TypeVar("_Goal")


class GoalTable(Generic[_Goal]):
    """Goals in the order in which they arrived, up to a limit. Not thread-safe.

    When the table is full, a new goal replaces the oldest one that has ended; if none has, it is refused.
    """

    def __init__(self, limit: int, id_characters: int, has_ended: Callable[[_Goal], bool]) -> None:
        """Starts empty.

        Args:
            limit: goals.
            id_characters: the longest id.
            has_ended: whether a goal is only kept for its status.
        """
        self._limit = limit
        self._id_characters = id_characters
        self._has_ended = has_ended
        self._goals: dict[str, _Goal] = {}

    def __iter__(self) -> Iterator[_Goal]:
        return iter(list(self._goals.values()))

    def find(self, goal_id: str) -> _Goal | None:
        """Return the goal with this id."""
        return self._goals.get(goal_id)

    def meant_by(self, goal_id: str, stamp: int, stamp_of: Callable[[_Goal], int]) -> list[_Goal]:
        """Return the goals that a cancellation request means, as defined by actionlib_msgs/GoalID.

        An id means one goal, a stamp (ns) all goals up to it, both mean the goal and those up to the stamp;
        an empty id and the stamp 0 mean all goals.
        """
        named = self.find(goal_id)
        if goal_id and not stamp:
            return [] if named is None else [named]
        return [goal for goal in self if not stamp or goal is named or stamp_of(goal) <= stamp]

    def add(self, goal_id: str, goal: _Goal) -> bool:
        """Add a goal; return False if the table is full or the id is too long."""
        if len(goal_id) > self._id_characters:
            return False
        if len(self._goals) >= self._limit:
            ended = next((key for key, each in self._goals.items() if self._has_ended(each)), None)
            if ended is None:
                return False
            del self._goals[ended]
        self._goals[goal_id] = goal
        return True

    def keep(self, is_kept: Callable[[_Goal], bool]) -> None:
        """Drop the goals for which the function returns False."""
        self._goals = {key: goal for key, goal in self._goals.items() if is_kept(goal)}
