"""Compute smooth timestamps from a device's clock."""

from __future__ import annotations

from typing import Final

from pipros_robot.perception.drivers.urg.scip import CLOCK_MS

USED_AFTER: Final = 100
"""Number of timestamps to average before the result is used."""
WEIGHT: Final = 0.01
"""The weight of the newest timestamp in the average."""
LARGEST_S: Final = 0.1
"""Deviation of a timestamp from the average above which averaging restarts."""


class DeviceClock:
    """Exponential moving average of the difference between the host's and the device's clock."""

    def __init__(self) -> None:
        self._last_ms, self._elapsed_s = 0, 0.0
        self._offset_s, self._count = 0.0, 0

    def host_s(self, device_ms: int, received_s: float) -> float:
        """Convert the device's time to the host's. `received_s` is the host's time of receipt.

        Until more than `USED_AFTER` timestamps have been averaged, return `received_s`.
        """
        self._elapsed_s += (device_ms - self._last_ms) % CLOCK_MS / 1000
        self._last_ms = device_ms
        offset_s = received_s - self._elapsed_s
        if not self._count or abs(offset_s - self._offset_s) > LARGEST_S:
            self._offset_s, self._count = offset_s, 0
        self._offset_s += WEIGHT * (offset_s - self._offset_s)
        self._count += 1
        return self._elapsed_s + self._offset_s if self._count > USED_AFTER else received_s
