"""Velocity commands from a joystick, configured by the parameters of `teleop_twist_joy`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.velocities import SILENCE_S

LINEAR = ("x", "y", "z")
ANGULAR = ("yaw", "pitch", "roll")
REPEATS: Final = 3
"""How often a joystick sends an unchanged state in a row before its silence counts as a failure."""


def by_direction(value: Any, name: str, first: str, known: Sequence[str]) -> dict[str, float]:
    """Convert a parameter to a mapping of directions to numbers. A single number applies to `first`.

    Raises:
        InvalidParameter: the value is neither a number nor a mapping of directions in `known` to numbers.
    """
    given = value if isinstance(value, Mapping) else {first: value}
    for direction, number in given.items():
        is_number = isinstance(number, int | float) and not isinstance(number, bool) and math.isfinite(number)
        if direction not in known or not is_number:
            raise InvalidParameter(
                f"{name} must be a number or map directions ({', '.join(known)}) to numbers, got {value!r}"
            )
    return {direction: float(number) for direction, number in given.items()}


@dataclass(frozen=True, slots=True)
class AxisMap:
    """The joystick axes that control a linear or angular velocity, and their scales.

    Attributes:
        axes: index of the joystick axis for each direction.
        scales, turbo_scales: velocity at full deflection for each direction; 0 for a missing direction.
    """

    axes: Mapping[str, float]
    scales: Mapping[str, float]
    turbo_scales: Mapping[str, float]

    def velocity(self, direction: str, axes: Sequence[float], *, is_turbo: bool) -> float:
        """Return the velocity in a direction, or 0 if the joystick lacks the axis."""
        index = int(self.axes.get(direction, -1))
        if not 0 <= index < len(axes):
            return 0.0
        return (self.turbo_scales if is_turbo else self.scales).get(direction, 0.0) * axes[index]


@dataclass(slots=True)
class JoyCommands:
    """Commands for a robot that moves only while a button is held.

    Attributes:
        enable_button: index of the button that enables motion with the normal scales.
        turbo_button: index of the button that enables motion with the turbo scales; -1 for no such button.
    """

    linear: AxisMap
    angular: AxisMap
    enable_button: int = 0
    turbo_button: int = -1
    _is_moving: bool = field(default=False, init=False)

    def command(
        self, axes: Sequence[float], buttons: Sequence[int]
    ) -> tuple[dict[str, float], dict[str, float]] | None:
        """Return the linear and angular velocities by direction, or None if there is nothing to publish.

        After the button is released, a single command with zero velocities stops the robot.
        """
        is_turbo = _is_pressed(buttons, self.turbo_button)
        if is_turbo or _is_pressed(buttons, self.enable_button):
            self._is_moving = True
            return (
                {name: self.linear.velocity(name, axes, is_turbo=is_turbo) for name in LINEAR},
                {name: self.angular.velocity(name, axes, is_turbo=is_turbo) for name in ANGULAR},
            )
        if not self._is_moving:
            return None
        self._is_moving = False
        return dict.fromkeys(LINEAR, 0.0), dict.fromkeys(ANGULAR, 0.0)


class JoySilence:
    """How long a joystick may be silent.

    A joystick that repeats an unchanged state, as `joy_node` does with `~autorepeat_rate`, has failed if it
    is silent for `SILENCE_S`. One that publishes changes only may be held still for any time.
    """

    def __init__(self, timeout_s: float | None = None) -> None:
        """Create the rule. `timeout_s` replaces it for all joysticks."""
        self._timeout_s = timeout_s
        self._last: object = None
        self._repeats = 0

    def after(self, axes: Sequence[float], buttons: Sequence[int]) -> float:
        """Record a state. Return the longest silence in seconds that may follow it."""
        if self._timeout_s is not None:
            return self._timeout_s
        state = (*axes, *buttons)
        if self._repeats < REPEATS:
            self._repeats = self._repeats + 1 if state == self._last else 0
        self._last = state
        return SILENCE_S if self._repeats >= REPEATS else math.inf


def _is_pressed(buttons: Sequence[int], number: int) -> bool:
    return 0 <= number < len(buttons) and bool(buttons[number])
