"""Velocity commands of one person who steers a robot: limited, repeated, and ended by silence. No sockets."""

from __future__ import annotations

import math
from dataclasses import dataclass

SILENCE_S = 0.5
"""A robot is stopped if its browser has sent no command for this long."""


@dataclass(frozen=True, slots=True)
class Velocity:
    """Speed in m/s and turn rate in rad/s."""

    linear: float = 0.0
    angular: float = 0.0


ZERO = Velocity()


class VelocityCommands:
    """What to publish: the last command while it is not zero and not old, then zero once."""

    def __init__(self, most: Velocity) -> None:
        """`most` has the largest absolute values of both parts."""
        self._most = most
        self._wanted = ZERO
        self._last_s = -math.inf
        self._is_moving = False

    def steer(self, wanted: Velocity, now_s: float) -> None:
        """Take a command, reduced to the limits."""
        self._wanted = Velocity(
            _limited(wanted.linear, self._most.linear), _limited(wanted.angular, self._most.angular)
        )
        self._last_s = now_s

    def due(self, now_s: float) -> Velocity | None:
        """Return the command to publish now, or None if the robot stands and has been told so."""
        wanted = self._wanted if now_s - self._last_s < SILENCE_S else ZERO
        if wanted == ZERO:
            return self.end()
        self._is_moving = True
        return wanted

    def end(self) -> Velocity | None:
        """Return the command that stops the robot, or None if it stands."""
        was_moving, self._is_moving = self._is_moving, False
        self._wanted = ZERO
        return ZERO if was_moving else None


def _limited(value: float, most: float) -> float:
    return max(-most, min(most, value))
