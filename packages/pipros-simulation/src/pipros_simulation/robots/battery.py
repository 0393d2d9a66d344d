"""The battery of a simulated robot: its charge over time, and a voltage that depends on the charge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

SECONDS_PER_HOUR: Final = 3600.0


@dataclass(frozen=True, slots=True)
class BatterySettings:
    """Settings of a battery and its load.

    Attributes:
        capacity_ah: charge of a full battery, in ampere hours.
        full_v, empty_v: voltages of a full and of an empty battery. In between, the voltage depends linearly
            on the charge.
        idle_a: current while the robot does not move.
        drive_a: additional current at maximum speed; proportional to the speed.
        charge_a: current from the charger.
    """

    capacity_ah: float = 1.8
    full_v: float = 12.6
    empty_v: float = 10.5
    idle_a: float = 0.6
    drive_a: float = 1.8
    charge_a: float = 5.0


class Battery:
    """A battery, initially full.

    Attributes:
        charge_ah: the remaining charge.
        current_a: current of the last step; negative while discharging.
        is_charging: whether a charger is connected.
    """

    def __init__(self, settings: BatterySettings) -> None:
        self.settings = settings
        self.charge_ah = settings.capacity_ah
        self.current_a = 0.0
        self.is_charging = False

    @property
    def percentage(self) -> float:
        """The remaining charge as a fraction of the capacity, from 0 to 1."""
        return self.charge_ah / self.settings.capacity_ah

    @property
    def voltage(self) -> float:
        full, empty = self.settings.full_v, self.settings.empty_v
        return empty + (full - empty) * self.percentage

    @property
    def is_empty(self) -> bool:
        """Whether the battery is empty and not charging. The motors then stop."""
        return self.charge_ah <= 0.0 and not self.is_charging

    def step(self, load: float, duration_s: float) -> None:
        """Advance the time, with the motors at the given load (0 to 1)."""
        settings = self.settings
        used = 0.0 if self.is_empty else settings.idle_a + settings.drive_a * load
        current = (settings.charge_a if self.is_charging else 0.0) - used
        before = self.charge_ah
        after = before + current * duration_s / SECONDS_PER_HOUR
        self.charge_ah = min(max(after, 0.0), settings.capacity_ah)
        self.current_a = current if after == self.charge_ah else 0.0
