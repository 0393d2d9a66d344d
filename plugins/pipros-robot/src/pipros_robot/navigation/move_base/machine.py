"""The state machine of move_base for one goal. This module reads no clock and performs no I/O.

A goal begins in PLANNING. Once there is a plan, the state is CONTROLLING until the robot arrives. If there is
no plan, no legal command, or no progress for too long, recovery behaviours are run one after the other
(CLEARING), each followed by PLANNING. After the last behaviour, the goal is aborted. Times are in seconds of
the node's clock.

Source: http://wiki.ros.org/move_base, and the behaviour of the genuine node.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from pipros_libraries.actions.server_goal import GoalEvent
from pipros_robot.navigation.move_base.settings import MoveBaseSettings
from pipros_robot.navigation.plane import Poses, Triple

STILL: Triple = (0.0, 0.0, 0.0)


class DrivingState(Enum):
    """Phase of a drive to a goal."""

    PLANNING = "planning"
    CONTROLLING = "controlling"
    CLEARING = "clearing"


class Trigger(Enum):
    """Why a recovery began. The value is the text of the goal's result if no behaviour helps."""

    PLANNING = "Failed to find a valid plan. Even after executing recovery behaviors."
    CONTROLLING = "Failed to find a valid control. Even after executing recovery behaviors."
    OSCILLATION = "Robot is oscillating. Even after executing recovery behaviors."


@dataclass(frozen=True, slots=True)
class End:
    """The end of a goal: the event for the action, and the text of the result."""

    event: GoalEvent
    text: str


class Base(Protocol):
    """Interface through which the state machine controls the robot.

    A protocol because its implementation, `MoveBase`, imports this module.
    """

    def pose(self) -> Triple | None:
        """Return the pose in the global frame, or None if it is unknown."""

    def can_see(self) -> bool:
        """Return whether the sensor data of the local costmap is recent."""

    def follow(self, plan: Poses) -> bool:
        """Pass a plan to the local planner. Return False if it rejects the plan."""

    def has_arrived(self) -> bool:
        """Return whether the robot has reached the local planner's goal."""

    def command(self) -> Triple | None:
        """Return the next velocity, or None if there is no legal one."""

    def drive(self, velocity: Triple) -> None:
        """Send a velocity to the robot."""

    def begin_recovery(self, index: int, trigger: Trigger) -> bool:
        """Begin a recovery behaviour. Return False if no behaviour has this index."""

    def recover(self) -> bool:
        """Continue the behaviour. Return True when it has ended."""


class GoalMachine:
    """The state of the current goal. Not thread-safe.

    Attributes:
        state: the current phase.
        is_recovering: whether a recovery behaviour runs.
        wants_plan: whether the planner should run; call `planned` with its result.
        settings: the parameters, which may be replaced.
    """

    def __init__(self, base: Base, settings: MoveBaseSettings) -> None:
        self.settings = settings
        self._base = base
        self._plan: Poses | None = None
        self._reset()

    def _reset(self) -> None:
        self._is_unplanned = False  # the robot follows the plan of a goal that was replaced
        self.state = DrivingState.PLANNING
        self.wants_plan = False
        self.is_recovering = False
        self._index, self._trigger = 0, Trigger.PLANNING
        self._retries = 0
        self._moved_from = (math.inf, math.inf)
        self._moved_s = self._plan_s = self._control_s = 0.0

    def begin(self, now_s: float, *, replaces: bool) -> None:
        """Start a goal. If it replaces another goal, the robot follows the last plan until a new one.

        Without a plan to follow, it is stopped: nothing compares a velocity with obstacles.
        """
        self._is_unplanned = replaces and self.state is DrivingState.CONTROLLING
        self._index, self.wants_plan = 0, True
        if not self._is_unplanned:
            self.state = DrivingState.PLANNING
            self._base.drive(STILL)
        if not replaces:
            self._moved_from = (math.inf, math.inf)
        self._control_s = self._plan_s = self._moved_s = now_s
        self._retries = 0

    def stop(self) -> None:
        """Abandon the goal, and stop the robot."""
        self._reset()
        self._base.drive(STILL)

    def planned(self, plan: Poses | None, now_s: float, *, is_current: bool = True) -> None:
        """Record the planner's result (None if it found no plan). Do nothing if `wants_plan` is false.

        A plan to a goal that was replaced meanwhile (`is_current` is false) is followed until there is a new
        one, if the robot already moves. Goals that arrive faster than plans would stop it otherwise.
        """
        if not self.wants_plan:
            return
        self._follow_clock(now_s)
        if not is_current:
            self._plan = plan if plan is not None and self._is_unplanned else self._plan
            return
        if plan is None and self._is_unplanned:
            self._halt_without_plan()
        if plan is not None:
            self._is_unplanned = False
            self._plan, self._plan_s, self._retries = plan, now_s, 0
            self.state = DrivingState.CONTROLLING
            self.wants_plan = self.settings.planner_frequency > 0
        elif self.state is DrivingState.PLANNING:
            self._retries += 1
            is_over = 0 <= self.settings.max_planning_retries < self._retries
            if is_over or now_s > self._plan_s + self.settings.planner_patience:
                self.wants_plan = False
                self._clear(Trigger.PLANNING)

    def _clear(self, trigger: Trigger) -> None:
        self.state, self._trigger = DrivingState.CLEARING, trigger
        self._base.drive(STILL)

    def _halt_without_plan(self) -> None:
        self._is_unplanned, self._plan = False, None
        self.state = DrivingState.PLANNING
        self._base.drive(STILL)

    def cycle(self, now_s: float) -> End | None:
        """Perform the next step. Return an `End` if this step ended the goal, otherwise None."""
        self._follow_clock(now_s)
        if self.is_recovering:
            self._continue_recovery(now_s)
            return None
        self._note_motion(now_s)
        if not self._base.can_see():
            self._base.drive(STILL)
            return None
        if self._plan is not None:
            plan, self._plan = self._plan, None
            if not self._base.follow(plan):
                self.stop()
                return End(GoalEvent.ABORT, "Failed to pass global plan to the controller.")
            if self._trigger is Trigger.PLANNING:
                self._index = 0
        if self.state is DrivingState.PLANNING:
            self.wants_plan = True
        elif self.state is DrivingState.CONTROLLING:
            if self._base.has_arrived():
                if self._is_unplanned:  # at the previous goal
                    self._halt_without_plan()
                    return None
                self.stop()
                return End(GoalEvent.SUCCEED, "Goal reached.")
            self._control(now_s)
        elif self.settings.recovery_behavior_enabled and self._base.begin_recovery(
            self._index, self._trigger
        ):
            self.is_recovering = True
            self._continue_recovery(now_s)
        else:
            end = End(GoalEvent.ABORT, self._trigger.value)
            self.stop()
            return end
        return None

    def _follow_clock(self, now_s: float) -> None:
        """Restart all waits that began later than now, before the clock moved back."""
        self._control_s, self._plan_s = min(self._control_s, now_s), min(self._plan_s, now_s)
        self._moved_s = min(self._moved_s, now_s)

    def _note_motion(self, now_s: float) -> None:
        pose = self._base.pose()
        if pose is None:
            return
        if math.dist(pose[:2], self._moved_from) >= self.settings.oscillation_distance:
            self._moved_from, self._moved_s = pose[:2], now_s
            if self._trigger is Trigger.OSCILLATION:
                self._index = 0

    def _control(self, now_s: float) -> None:
        limit_s = self.settings.oscillation_timeout
        if limit_s > 0 and now_s > self._moved_s + limit_s:
            self._clear(Trigger.OSCILLATION)
        command = self._base.command()
        if command is not None:
            self._control_s = now_s
            self._base.drive(command)
            if self._trigger is Trigger.CONTROLLING:
                self._index = 0
        elif now_s > self._control_s + self.settings.controller_patience:
            self._clear(Trigger.CONTROLLING)
        else:
            self._halt_without_plan()
            self._plan_s, self._retries = now_s, 0
            self.wants_plan = True

    def _continue_recovery(self, now_s: float) -> None:
        if self._base.recover():
            self._base.drive(STILL)
            self.is_recovering = False
            self.state, self._index = DrivingState.PLANNING, self._index + 1
            self._moved_s = self._plan_s = now_s
            self._retries = 0
