"""The states of a goal, with a robot that only notes what it is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from pipros_libraries.actions.server_goal import GoalEvent
from pipros_robot.navigation.move_base.machine import STILL, DrivingState, End, GoalMachine, Trigger
from pipros_robot.navigation.move_base.settings import MoveBaseSettings
from pipros_robot.navigation.plane import Poses, Triple

PLAN: Any = np.zeros((3, 3))
DRIVE: Triple = (0.5, 0.0, 0.0)


class Robot:
    """A robot with two recovery behaviours, which take `recovery_cycles` cycles each."""

    def __init__(self) -> None:
        self.at: Triple = (0.0, 0.0, 0.0)
        self.sees = self.follows = True
        self.arrived = False
        self.next: Triple | None = DRIVE
        self.driven: list[Triple] = []
        self.recoveries: list[tuple[int, Trigger]] = []
        self.recovery_cycles = 1
        self._left = 0

    def pose(self) -> Triple | None:
        return self.at

    def can_see(self) -> bool:
        return self.sees

    def follow(self, _: Poses) -> bool:
        return self.follows

    def has_arrived(self) -> bool:
        return self.arrived

    def command(self) -> Triple | None:
        return self.next

    def drive(self, velocity: Triple) -> None:
        self.driven.append(velocity)

    def begin_recovery(self, index: int, trigger: Trigger) -> bool:
        if index > 1:
            return False
        self.recoveries.append((index, trigger))
        self._left = self.recovery_cycles
        return True

    def recover(self) -> bool:
        self._left -= 1
        return self._left <= 0


def machine(robot: Robot, **patience: Any) -> GoalMachine:
    made = GoalMachine(
        robot, MoveBaseSettings(**{"controller_patience": 3.0, "planner_patience": 5.0, **patience})
    )
    made.begin(100.0, replaces=False)
    return made


def run(made: GoalMachine, seconds: Sequence[int], plan: Any = None) -> End | None:
    """Plan (if wanted) and run a cycle at each second after the beginning; stop at the end of the goal."""
    for second in seconds:
        now_s = 100.0 + second
        if made.wants_plan:
            made.planned(plan, now_s)
        end = made.cycle(now_s)
        if end is not None:
            return end
    return None


def test_a_goal_is_planned_driven_and_reached() -> None:
    robot = Robot()
    made = machine(robot)
    assert (robot.driven, made.state, made.wants_plan) == ([STILL], DrivingState.PLANNING, True)

    assert run(made, [0, 1, 2], PLAN) is None
    assert (made.state, made.wants_plan, robot.driven[1:]) == (DrivingState.CONTROLLING, False, [DRIVE] * 3)

    robot.arrived = True
    assert run(made, [3]) == End(GoalEvent.SUCCEED, "Goal reached.")
    assert (robot.driven[-1], made.state, made.wants_plan) == (STILL, DrivingState.PLANNING, False)


def test_with_a_planner_frequency_planning_goes_on_and_failures_while_driving_do_not_matter() -> None:
    robot = Robot()
    made = machine(robot, planner_frequency=1.0)
    run(made, [0], PLAN)
    assert made.wants_plan
    run(made, range(1, 20), None)
    assert (made.state, robot.recoveries) == (DrivingState.CONTROLLING, [])


def test_without_a_plan_the_recoveries_run_in_turn_and_then_the_goal_is_aborted() -> None:
    robot = Robot()
    end = run(machine(robot), range(40))
    assert robot.recoveries == [(0, Trigger.PLANNING), (1, Trigger.PLANNING)]
    assert end == End(
        GoalEvent.ABORT, "Failed to find a valid plan. Even after executing recovery behaviors."
    )
    assert DRIVE not in robot.driven


@pytest.mark.parametrize(("retries", "recoveries"), [(2, 1), (-1, 0)])
def test_too_many_failures_begin_the_recovery_before_the_patience_ends(retries: int, recoveries: int) -> None:
    robot = Robot()
    run(machine(robot, max_planning_retries=retries), range(4))
    assert len(robot.recoveries) == recoveries


def test_a_plan_after_a_recovery_starts_again_with_the_first_behaviour() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, range(8))
    run(made, [8, 9], PLAN)
    assert made.state is DrivingState.CONTROLLING
    made.begin(110.0, replaces=True)
    run(made, range(10, 20))
    assert [index for index, _ in robot.recoveries] == [0, 0]


def test_without_a_command_the_robot_stops_plans_again_and_recovers_after_the_patience() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    robot.next = None
    run(made, [1, 2, 3], PLAN)
    assert (robot.driven[-3:], robot.recoveries) == ([STILL] * 3, [])
    end = run(made, range(4, 20), PLAN)
    assert [index for index, _ in robot.recoveries] == [0, 1]
    assert end == End(
        GoalEvent.ABORT, "Failed to find a valid control. Even after executing recovery behaviors."
    )


def test_a_command_after_a_recovery_starts_again_with_the_first_behaviour() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    for second in range(1, 30):
        robot.next = DRIVE if second % 7 == 0 else None
        assert run(made, [second], PLAN) is None
    assert {index for index, _ in robot.recoveries} == {0}


def test_a_robot_that_does_not_get_on_oscillates() -> None:
    robot = Robot()
    made = machine(robot, oscillation_timeout=4.0, oscillation_distance=0.5)
    run(made, range(4), PLAN)
    robot.at = (0.6, 0.0, 0.0)
    assert run(made, range(4, 8), PLAN) is None, "it moved"
    end = run(made, range(8, 40), PLAN)
    assert robot.recoveries == [(0, Trigger.OSCILLATION), (1, Trigger.OSCILLATION)]
    assert end == End(GoalEvent.ABORT, "Robot is oscillating. Even after executing recovery behaviors.")


def test_blind_robots_stop_and_refused_plans_abort() -> None:
    robot = Robot()
    made = machine(robot)
    robot.sees = False
    assert run(made, [0, 1], PLAN) is None
    assert robot.driven == [STILL] * 3
    robot.sees, robot.follows = True, False
    assert run(made, [2]) == End(GoalEvent.ABORT, "Failed to pass global plan to the controller.")


def test_a_long_recovery_is_finished_before_anything_else_and_may_be_switched_off() -> None:
    robot = Robot()
    robot.recovery_cycles = 3
    made = machine(robot)
    run(made, range(7))
    assert made.is_recovering
    run(made, [7, 8])
    assert not made.is_recovering
    assert made.state is DrivingState.PLANNING

    end = run(machine(Robot(), recovery_behavior_enabled=False), range(20))
    assert end is not None
    assert end.text == Trigger.PLANNING.value


def test_a_replaced_goal_does_not_stop_the_robot_and_a_stopped_one_does() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0, 1], PLAN)
    made.begin(102.0, replaces=True)
    assert (robot.driven[-1], made.state, made.wants_plan) == (DRIVE, DrivingState.CONTROLLING, True)
    made.stop()
    assert (robot.driven[-1], made.wants_plan) == (STILL, False)
    made.planned(PLAN, 103.0)
    assert made.state is DrivingState.PLANNING, "a plan that comes too late changes nothing"


def test_patience_begins_again_if_the_time_moves_back() -> None:
    robot = Robot()
    made = machine(robot)
    assert run(made, [1]) is None
    assert run(made, [-90, -86]) is None
    assert made.state is DrivingState.PLANNING
    assert run(made, [-84, -83]) is None
    assert robot.recoveries == [(0, Trigger.PLANNING)]


def test_goals_that_arrive_in_each_cycle_neither_silence_nor_blind_the_robot() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    for second in range(101, 120):
        made.begin(float(second), replaces=True)
        before = len(robot.driven)
        made.cycle(float(second))
        assert robot.driven[before:] == [DRIVE], "a command of the local planner, along the last plan"
    robot.arrived = True
    assert made.cycle(120.0) is None, "the robot is at a goal that was replaced"
    assert (robot.driven[-1], made.state) == (STILL, DrivingState.PLANNING)


def test_a_robot_stops_if_the_goal_that_replaces_another_has_no_plan() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    made.begin(101.0, replaces=True)
    made.planned(None, 101.0)
    assert (robot.driven[-1], made.state) == (STILL, DrivingState.PLANNING)
