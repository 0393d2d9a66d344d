"""A moving obstacle: a disc that moves from point to point, waits for robots, and turns back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from pipros_simulation.robots.errors import InvalidSettings

PATIENCE_S = 3.0
"""Time that an obstacle waits before it turns back."""


class Obstacle:
    """A disc on a closed path through its points, at a constant speed. Walls do not stop it.

    Attributes:
        x, y: its position in the map frame, in metres.
        radius: its radius in metres.
    """

    def __init__(
        self, points: Sequence[tuple[float, float]], radius: float = 0.2, speed: float = 0.4
    ) -> None:
        """Put the obstacle at its first point.

        Raises:
            InvalidSettings: there is no point, the radius is not > 0 or the speed is not >= 0.
        """
        if not points or radius <= 0 or speed < 0:
            raise InvalidSettings(
                f"an obstacle needs at least one point, radius > 0 and speed >= 0, "
                f"got {len(points)} points, {radius:g} and {speed:g}"
            )
        self.radius = radius
        self._points, self._speed = list(points), speed
        self.reset()

    def reset(self) -> None:
        """Move back to the first point."""
        self.x, self.y = self._points[0]
        self._next, self._direction, self._waited_s = 1 % len(self._points), 1, 0.0

    def step(self, duration_s: float, is_free: Callable[[float, float, float], bool]) -> None:
        """Advance if `is_free` returns True for the next x, y and radius. Otherwise, wait, then turn back."""
        x, y = self._points[self._next]
        left, way = math.hypot(x - self.x, y - self.y), self._speed * duration_s
        if left > way:
            x, y = self.x + (x - self.x) * way / left, self.y + (y - self.y) * way / left
        if is_free(x, y, self.radius):
            self.x, self.y = x, y
            self._waited_s = 0.0
            if left <= way:
                self._next = (self._next + self._direction) % len(self._points)
            return
        self._waited_s += duration_s
        if self._waited_s >= PATIENCE_S:
            self._direction, self._waited_s = -self._direction, 0.0
            self._next = (self._next + self._direction) % len(self._points)
