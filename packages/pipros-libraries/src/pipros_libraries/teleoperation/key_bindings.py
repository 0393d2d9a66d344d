"""Key bindings of `teleop_twist_keyboard`: directions, speeds and their limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

Direction = tuple[int, int, int, int]
"""Factors for the speed along x, y and z, and for the turn rate about z."""

STOP: Final[Direction] = (0, 0, 0, 0)

MOVES: Final[dict[str, Direction]] = {
    "i": (1, 0, 0, 0),
    "o": (1, 0, 0, -1),
    "j": (0, 0, 0, 1),
    "l": (0, 0, 0, -1),
    "u": (1, 0, 0, 1),
    ",": (-1, 0, 0, 0),
    ".": (-1, 0, 0, 1),
    "m": (-1, 0, 0, -1),
    "O": (1, -1, 0, 0),
    "I": (1, 0, 0, 0),
    "J": (0, 1, 0, 0),
    "L": (0, -1, 0, 0),
    "U": (1, 1, 0, 0),
    "<": (-1, 0, 0, 0),
    ">": (-1, -1, 0, 0),
    "M": (-1, 1, 0, 0),
    "t": (0, 0, 1, 0),
    "b": (0, 0, -1, 0),
}
SPEEDS: Final = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
"""Factors by which keys change the speed and the turn rate."""


@dataclass(slots=True)
class KeyedMotion:
    """The motion selected by the keys pressed so far.

    Attributes:
        speed, turn: linear speed in m/s and turn rate in rad/s. Keys change them up to their limits.
        direction: direction of the last movement key; STOP after any other key that does not change the
            speeds.
    """

    speed: float = 0.5
    turn: float = 1.0
    speed_limit: float = 1000.0
    turn_limit: float = 1000.0
    direction: Direction = field(default=STOP)

    def press(self, key: str) -> bool:
        """Handle a key press. Return True if it changed the speeds.

        An empty string means that no key was pressed for some time.
        """
        if key in SPEEDS:
            self.speed = min(self.speed_limit, self.speed * SPEEDS[key][0])
            self.turn = min(self.turn_limit, self.turn * SPEEDS[key][1])
            return True
        self.direction = MOVES.get(key, STOP)
        return False

    @property
    def linear(self) -> tuple[float, float, float]:
        """Linear velocity along x, y and z."""
        x, y, z, _ = self.direction
        return x * self.speed, y * self.speed, z * self.speed

    @property
    def angular(self) -> float:
        """Angular velocity about z."""
        return self.direction[3] * self.turn
