"""A simulated lithium-ion pack, for machines without a battery."""

import random

from vehicle_battery.reading import Reading

# Open-circuit voltage of one cell, in equal steps of charge from empty to full.
_CELL_VOLTS = (3.00, 3.45, 3.56, 3.62, 3.67, 3.73, 3.80, 3.88, 3.97, 4.07, 4.20)
_CELL_OHMS = 0.025
_AMBIENT_CELSIUS = 21.0
_CELSIUS_PER_WATT = 2.5
_SECONDS_TO_WARM = 600.0


class SimulatedPack:
    """A pack under a load that varies by a third. An empty pack is charged until it is full.

    `seed` determines the load, so packs with the same seed and settings behave identically.
    """

    def __init__(self, percentage=1.0, capacity=10.0, cells=4, load=5.0, charger=8.0, seed=1):
        if not 0.0 <= percentage <= 1.0:
            raise ValueError(f"percentage must be from 0 to 1, got {percentage}")
        if min(capacity, cells, load, charger) <= 0:
            raise ValueError("capacity, cells, load and charger must be positive")
        self._capacity, self._cells, self._load, self._charger = capacity, cells, load, charger
        self._charge = percentage * capacity
        self._temperature = _AMBIENT_CELSIUS
        self._current = -load
        self._is_charging = False
        self._random = random.Random(seed)

    def advance(self, seconds):
        """Simulate the given time."""
        if self._is_charging:
            self._current = self._charger
        else:
            self._current = -self._load * self._random.uniform(2 / 3, 4 / 3)
        self._charge += self._current * seconds / 3600
        heat = self._current**2 * _CELL_OHMS * self._cells
        goal = _AMBIENT_CELSIUS + heat * _CELSIUS_PER_WATT
        self._temperature += (goal - self._temperature) * min(seconds / _SECONDS_TO_WARM, 1.0)
        if self._charge <= 0:
            self._charge, self._is_charging = 0.0, True
        elif self._charge >= self._capacity:
            self._charge, self._is_charging = self._capacity, False

    def read(self):
        """Return the current reading."""
        percentage = self._charge / self._capacity
        return Reading(
            percentage=percentage,
            voltage=self._cells * (_volts_at_rest(percentage) + self._current * _CELL_OHMS),
            current=self._current,
            charge=self._charge,
            capacity=self._capacity,
            design_capacity=self._capacity,
            temperature=self._temperature,
            status="Charging" if self._is_charging else "Discharging",
            health="Good",
            technology="Li-ion",
            location="simulated",
            serial_number="simulated",
        )


def _volts_at_rest(percentage):
    steps = len(_CELL_VOLTS) - 1
    step = min(int(percentage * steps), steps - 1)
    low, high = _CELL_VOLTS[step : step + 2]
    return low + (high - low) * (percentage * steps - step)
