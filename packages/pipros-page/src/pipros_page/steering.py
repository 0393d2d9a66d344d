"""Limit, repeat and time out one user's velocity commands for a robot. Performs no I/O."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

SILENCE_S = 0.5
"""A robot is stopped if the browser has sent no command for this long."""


@dataclass(frozen=True, slots=True)
class Velocity:
    """Speed in m/s and turn rate in rad/s."""

    linear: float = 0.0
    angular: float = 0.0


ZERO = Velocity()


class VelocityCommands:
    """Selects the velocity to publish: the last command or, once it is zero or too old, a single zero.

    Thread-safe: the browser's commands arrive in another thread than the one that publishes them.
    """

    def __init__(self, limit: Velocity) -> None:
        """Limit the absolute value of each component to `limit`."""
        self._limit = limit
        self._wanted = ZERO
        self._last_s = -math.inf
        self._is_moving = False
        self._lock = threading.RLock()

    def steer(self, wanted: Velocity, now_s: float) -> None:
        """Store a command, clamped to the limits."""
        with self._lock:
            self._wanted = Velocity(
                _limited(wanted.linear, self._limit.linear), _limited(wanted.angular, self._limit.angular)
            )
            self._last_s = now_s

    def due(self, now_s: float) -> Velocity | None:
        """Return the velocity to publish now, or None if the robot is already stopped."""
        with self._lock:
            wanted = self._wanted if now_s - self._last_s < SILENCE_S else ZERO
            if wanted == ZERO:
                return self.end()
            self._is_moving = True
            return wanted

    def end(self) -> Velocity | None:
        """Stop. Return the velocity to publish, or None if the robot is already stopped."""
        with self._lock:
            was_moving, self._is_moving = self._is_moving, False
            self._wanted = ZERO
            return ZERO if was_moving else None


def _limited(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
