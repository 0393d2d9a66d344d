"""Limit the speed and acceleration of velocity commands, as in yocs_velocity_smoother 0.8.

Velocities are pairs (v, w): forward in m/s, and counter-clockwise in rad/s. The caller provides the time.
"""

from __future__ import annotations

import logging
import math
import statistics
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

Velocity = tuple[float, float]

STOPPED: Final[Velocity] = (0.0, 0.0)

_INTERVALS: Final = 5
_KNOWN_INTERVALS: Final = 3
_USUAL_INTERVAL_S: Final = 0.1
_SILENT_S: Final = 0.5
_SLIP: Final[Velocity] = (0.2, 2.0)
"""Differences between the last command and the measured velocity above which the latter is used instead."""


class Feedback(IntEnum):
    """Source of the robot's measured velocity."""

    NONE = 0
    ODOMETRY = 1
    COMMANDS = 2


@dataclass(frozen=True, slots=True)
class VelocityLimits:
    """Limits of speed (m/s, rad/s) and acceleration (m/s², rad/s²).

    `deceleration` is a multiple of the acceleration.
    """

    speed: Velocity = (1.0, 5.0)
    acceleration: Velocity = (0.5, 2.5)
    deceleration: float = 1.0


class VelocitySmoother:
    """Converts commands to smooth commands, one per period.

    Attributes:
        limits: the limits, which can be replaced at any time.
    """

    def __init__(
        self, limits: VelocityLimits, period_s: float, feedback: Feedback, log: Callable[[int, str], object]
    ) -> None:
        """Create a smoother for a robot at rest.

        Args:
            log: called with a `logging` level and a text if the input is silent, or if the measured velocity
                replaces the last command.
        """
        self.limits = limits
        self._period_s = period_s
        self._feedback = feedback
        self._log = log
        self._target = self._last = self._measured = STOPPED
        self._is_active = False
        self._arrived_s = 0.0
        self._intervals: deque[float] = deque(maxlen=_INTERVALS)

    def command(self, velocity: Velocity, now_s: float) -> None:
        """Record a new command."""
        if self._arrived_s:
            self._intervals.append(now_s - self._arrived_s)
        self._arrived_s, self._is_active = now_s, True
        self._target = self._limited(velocity)

    def measured(self, velocity: Velocity) -> None:
        """Record the measured velocity of the robot. Values that are not finite are ignored."""
        if all(map(math.isfinite, velocity)):
            self._measured = velocity

    def step(self, now_s: float) -> Velocity | None:
        """Return the command for the current period, or None if none is needed."""
        known = len(self._intervals) >= _KNOWN_INTERVALS
        usual_s = statistics.median(self._intervals) if known else _USUAL_INTERVAL_S
        silent_s = now_s - self._arrived_s
        if self._is_active and not 0 <= silent_s <= min(3 * usual_s, _SILENT_S):
            self._is_active = False
            if self._target != STOPPED:
                self._log(
                    logging.WARNING, f"the input is silent, so the robot is stopped (after {silent_s:.2f} s)"
                )
                self._target = STOPPED
        if self._feedback and self._is_active:
            slips = (
                abs(now - last) > limit
                for now, last, limit in zip(self._measured, self._last, _SLIP, strict=True)
            )
            if silent_s > 5 * usual_s or any(slips):
                self._log(
                    logging.WARNING,
                    f"the measured velocity {self._measured} replaces the last command {self._last}",
                )
                self._last = self._limited(self._measured)
        self._target = self._limited(self._target)  # the limits may be lower now
        if self._target == self._last:
            return self._last if self._is_active else None
        self._last = self._next()
        return self._last

    def _limited(self, velocity: Velocity) -> Velocity:
        v, w = (
            max(-limit, min(value, limit)) if math.isfinite(value) else 0.0
            for value, limit in zip(velocity, self.limits.speed, strict=True)
        )
        return v, w

    def _next(self) -> Velocity:
        change = [to - at for to, at in zip(self._target, self._last, strict=True)]
        limit = []
        for axis in (0, 1):
            most = self.limits.acceleration[axis] * self._period_s
            reverses = self._feedback is Feedback.ODOMETRY and self._measured[axis] * self._target[axis] < 0
            if reverses or change[axis] * self._target[axis] <= 0:
                most *= self.limits.deceleration
            limit.append(most)
        # Scale both changes by the same factor, which preserves the direction of the change.
        slope, size = math.atan2(limit[1], limit[0]), [abs(each) for each in change]
        if slope < math.atan2(size[1], size[0]):
            limit[0] = limit[1] * size[0] / size[1]
        elif size[0]:
            limit[1] = limit[0] * size[1] / size[0]
        v, w = (
            to if abs(step) <= most else at + math.copysign(most, step)
            for to, at, step, most in zip(self._target, self._last, change, limit, strict=True)
        )
        return v, w
