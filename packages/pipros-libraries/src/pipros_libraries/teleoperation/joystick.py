"""The state of a joystick, updated by events from the Linux joystick driver.

Source: Linux's Documentation/input/joydev/joystick-api.rst. An event has 8 bytes (little endian on all common
machines): a time in ms, a value, a type, and the number of the axis or button. Events of type INIT, which are
sent after the device is opened, describe the initial state.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

EVENT: Final = struct.Struct("=IhBB")
BUTTON, AXIS, INIT = 1, 2, 0x80
FULL: Final = 32767
TRIGGERS: Final = (2, 5)
"""Indices of the trigger axes. A released trigger is 1, but the driver reports 0 until its first movement."""


class StickChange(Enum):
    """The kind of change that an event caused, which determines when to publish."""

    NOTHING = 0
    INITIAL = 1
    AXIS = 2
    BUTTON = 3


@dataclass(slots=True)
class Joystick:
    """State of axes and buttons. Both lists grow, up to 256 elements, as events report higher indices.

    Attributes:
        deadzone: the deflection up to which an axis is read as 0, as a fraction of full deflection. Greater
            deflections are scaled to the full range.
        is_sticky: whether buttons toggle when pressed.
        has_triggers: whether the axes in `TRIGGERS` are 1, instead of 0, until they are moved.
    """

    deadzone: float = 0.05
    is_sticky: bool = False
    has_triggers: bool = False
    axes: list[float] = field(default_factory=list)
    buttons: list[int] = field(default_factory=list)

    def apply(self, event: bytes) -> StickChange:
        """Apply one event (`EVENT.size` bytes), and return the kind of change that it caused."""
        _, value, kind, number = EVENT.unpack(event)
        is_initial, kind = bool(kind & INIT), kind & ~INIT
        if kind == BUTTON:
            self.buttons += [0] * (number + 1 - len(self.buttons))
            if not self.is_sticky:
                self.buttons[number] = int(value != 0)
            elif value == 1 and not is_initial:
                self.buttons[number] = 1 - self.buttons[number]
        elif kind == AXIS:
            self.axes += [0.0] * (number + 1 - len(self.axes))
            self.axes[number] = self._scaled(value)
            if is_initial and self.has_triggers and value == 0 and number in TRIGGERS:
                self.axes[number] = 1.0
        else:
            return StickChange.NOTHING
        if is_initial:
            return StickChange.INITIAL
        return StickChange.BUTTON if kind == BUTTON else StickChange.AXIS

    def _scaled(self, value: int) -> float:
        """Return the position of an axis from -1 to 1, positive to the left and up."""
        dead = FULL * self.deadzone
        beyond = value - dead if value > dead else value + dead if value < -dead else 0.0
        return -beyond / (FULL - dead) + 0.0
