"""Choose the beams of a scan that the sensor models use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SMALLEST_SIGMA: Final = 1e-9
"""Replaces smaller standard deviations, to avoid a division by 0. Only an exact reading is then a hit."""


@dataclass(frozen=True, slots=True)
class Beams:
    """Some beams of a scan.

    Attributes:
        ranges: metres. `range_max` stands for readings that are too short, infinity for those that are too
            long.
        bearings: directions in the robot's frame, in radians.
        range_max: the laser's longest range, in metres.
        laser: position of the laser in the robot's frame, in metres.
    """

    ranges: Array
    bearings: Array
    range_max: float
    laser: tuple[float, float] = (0.0, 0.0)

    def end_points(self, particles: Array) -> tuple[Array, Array]:
        """Return x and y of the beams' ends, as seen from each particle; shape (particles, beams)."""
        forward = self.laser[0] + self.ranges * np.cos(self.bearings)
        left = self.laser[1] + self.ranges * np.sin(self.bearings)
        cosine, sine = np.cos(particles[:, 2:]), np.sin(particles[:, 2:])
        return particles[:, :1] + cosine * forward - sine * left, particles[
            :, 1:2
        ] + sine * forward + cosine * left

    def chosen(self, model: str, limit: int) -> Beams:
        """Return about `limit` beams at equal distances, as the sensor model of this name chooses them."""
        count = len(self.ranges)
        if model == "likelihood_field_prob":
            step = max(1, -(-count // limit))
        else:
            step = max(1, (count - 1) // (limit - 1))
        return Beams(self.ranges[::step], self.bearings[::step], self.range_max, self.laser)

    def short(self) -> Beams:
        """Return the beams that ended at an obstacle: those below `range_max`."""
        hits = self.ranges < self.range_max  # False for NaN
        return Beams(self.ranges[hits], self.bearings[hits], self.range_max, self.laser)


def read_beams(
    ranges: Array, bearings: Array, laser: tuple[float, float], range_min: float, range_max: float
) -> Beams:
    """Return the beams of a scan, with ranges from `range_min` to `range_max`; see `Beams`."""
    cleaned = np.where(ranges <= range_min, range_max, np.where(ranges > range_max, np.inf, ranges))
    return Beams(cleaned, bearings, range_max, laser)
