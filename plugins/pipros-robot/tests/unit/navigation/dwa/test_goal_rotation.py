"""Stopping and turning at the goal."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from pipros_robot.navigation.dwa.goal_rotation import STILL, GoalRotation
from pipros_robot.navigation.dwa.settings import DwaSettings

SETTINGS = DwaSettings(sim_period=0.1)
GOAL = (1.0, 1.0, 0.0)
YES: Callable[[object], bool] = lambda _: True  # noqa: E731


def test_the_robot_brakes_then_turns_then_stands() -> None:
    rotation = GoalRotation(SETTINGS, is_latching=False)
    at_goal = (1.05, 1.0, -1.0)

    assert rotation.command(at_goal, (0.4, 0.0, 0.5), GOAL, YES) == pytest.approx((0.15, 0.0, 0.18))
    assert rotation.command(at_goal, STILL, GOAL, YES) == pytest.approx((0.0, 0.0, 0.4))
    assert rotation.command(at_goal, (0.0, 0.0, 0.9), GOAL, YES) == pytest.approx((0.0, 0.0, 1.0))
    assert rotation.command((1.0, 1.0, 1.0), (0.0, 0.0, 0.9), GOAL, YES) == pytest.approx((0.0, 0.0, -1.0))
    assert rotation.command((1.0, 1.0, -0.05), STILL, GOAL, YES) == STILL
    assert rotation.command(at_goal, STILL, GOAL, lambda _: False) is None


def test_the_goal_is_reached_in_its_direction_and_standing() -> None:
    rotation = GoalRotation(SETTINGS, is_latching=False)

    assert rotation.has_reached((1.05, 1.05, 0.05), STILL, GOAL)
    assert rotation.has_reached((1.0, 1.0, math.tau), (0.1, 0.0, 0.1), GOAL)
    assert not rotation.has_reached((1.05, 1.05, 0.15), STILL, GOAL)
    assert not rotation.has_reached((1.2, 1.0, 0.0), STILL, GOAL)
    assert not rotation.has_reached((1.0, 1.0, 0.0), (0.2, 0.0, 0.0), GOAL)


@pytest.mark.parametrize("is_latching", [True, False])
def test_a_latched_goal_stays_reached_until_the_next_plan(is_latching: bool) -> None:
    rotation = GoalRotation(SETTINGS, is_latching=is_latching)
    assert rotation.is_there((1.0, 1.0, 2.0), GOAL)
    assert rotation.is_there((1.3, 1.0, 2.0), GOAL) == is_latching
    rotation.start_plan()
    assert not rotation.is_there((1.3, 1.0, 2.0), GOAL)
