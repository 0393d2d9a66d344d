"""The last phase of a drive: stop at the goal's position, then turn to the goal's direction."""

from __future__ import annotations

import math
from collections.abc import Callable

from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.plane import Triple

STILL: Triple = (0.0, 0.0, 0.0)


class GoalRotation:
    """Decides whether the goal is reached, and how to turn at it. Not thread-safe.

    Attributes:
        settings: the settings.
        is_latching: whether a robot that has reached the goal's position only turns, until the next plan.
        must_stand: whether the goal is reached only by a robot that has stopped.
    """

    def __init__(self, settings: DwaSettings, *, is_latching: bool, must_stand: bool = True) -> None:
        self.settings, self.is_latching = settings, is_latching
        self.must_stand = must_stand
        self._was_there = self._is_turning = False

    def start_plan(self) -> None:
        """Reset for a new plan: forget that the robot has been at the goal."""
        self._was_there = False

    def is_there(self, pose: Triple, goal: Triple) -> bool:
        """Return whether the robot is at the goal's position or, with `is_latching`, has been there."""
        distance = math.hypot(goal[0] - pose[0], goal[1] - pose[1])
        if distance <= self.settings.xy_goal_tolerance:
            self._was_there = True
            return True
        return self.is_latching and self._was_there

    def has_reached(self, pose: Triple, velocity: Triple, goal: Triple) -> bool:
        """Return whether the robot has stopped at the goal, facing in the goal's direction."""
        is_turned = abs(_difference(pose, goal)) <= self.settings.yaw_goal_tolerance
        is_still = not self.must_stand or self._stands(velocity)
        return self.is_there(pose, goal) and is_turned and is_still

    def command(
        self, pose: Triple, velocity: Triple, goal: Triple, is_legal: Callable[[Triple], bool]
    ) -> Triple | None:
        """Return the velocity for braking, or for turning to the goal's direction; None if illegal.

        The velocity is 0 if the robot already has the goal's direction.
        """
        settings, period_s = self.settings, self.settings.sim_period
        turn = _difference(pose, goal)
        if abs(turn) <= settings.yaw_goal_tolerance:
            self._is_turning = False
            return STILL
        if not self._is_turning and not self._stands(velocity):
            x, y, w = (
                math.copysign(max(0.0, abs(now) - gain * period_s), now)
                for now, gain in zip(velocity, settings.accelerations, strict=True)
            )
            return (x, y, w) if is_legal((x, y, w)) else None
        self._is_turning = True
        gain = settings.acc_lim_theta
        low, high = settings.min_vel_theta, settings.max_vel_theta
        speed = min(high, max(low, abs(turn)))
        speed = min(max(speed, abs(velocity[2]) - gain * period_s), abs(velocity[2]) + gain * period_s)
        speed = min(math.sqrt(2 * gain * abs(turn)), speed)
        command = (0.0, 0.0, math.copysign(min(high, max(low, speed)), turn))
        return command if is_legal(command) else None

    def _stands(self, velocity: Triple) -> bool:
        settings = self.settings
        is_slow = max(abs(velocity[0]), abs(velocity[1])) <= settings.trans_stopped_vel
        return is_slow and abs(velocity[2]) <= settings.theta_stopped_vel


def _difference(pose: Triple, goal: Triple) -> float:
    return math.remainder(goal[2] - pose[2], math.tau)
