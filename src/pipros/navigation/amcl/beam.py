"""The beam model: compare each beam with the range that the map predicts for it.

See Probabilistic Robotics, table 6.1, without its normalizing factors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from pipros.navigation.amcl.beams import SMALLEST_SIGMA, Beams
from pipros.navigation.amcl.grid import GridMap

Array = NDArray[np.float64]

LONGEST_M: Final = 10_000.0
"""Rays end here if the laser's longest range is greater, or infinite."""


@dataclass(frozen=True, slots=True)
class BeamMixture:
    """The weights of hits, short readings, longest readings and random readings.

    Attributes:
        sigma: standard deviation of hits in metres.
        decay: rate of short readings, per metre.
    """

    z_hit: float
    z_short: float
    z_max: float
    z_rand: float
    sigma: float
    decay: float


class BeamModel:
    """The model `beam`: as amcl, it adds the cubes of the probabilities of all beams."""

    def __init__(self, grid: GridMap, mixture: BeamMixture) -> None:
        self._mixture = mixture
        self._rays = RayCaster(grid)

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:  # noqa: ARG002
        """Return the factor for the weight of each particle: 1 + the sum of the cubes."""
        cosine, sine = np.cos(particles[:, 2]), np.sin(particles[:, 2])
        forward, left = beams.laser
        x = particles[:, 0] + cosine * forward - sine * left
        y = particles[:, 1] + sine * forward + cosine * left
        measured = beams.ranges[~np.isnan(beams.ranges)]
        angles = particles[:, 2:] + beams.bearings[~np.isnan(beams.ranges)]
        expected = self._rays.ranges(x, y, angles, beams.range_max)
        mix = self._mixture
        with np.errstate(invalid="ignore"):  # infinite ranges match nothing
            short = mix.z_short * mix.decay * np.exp(-mix.decay * measured)
            error = measured - expected
            probability = (
                mix.z_hit * np.exp(-(error**2) / (2.0 * max(mix.sigma, SMALLEST_SIGMA) ** 2))
                + (error < 0) * short
            )
        probability += np.where(measured == beams.range_max, mix.z_max, 0.0)
        probability += np.where(measured < beams.range_max, mix.z_rand / beams.range_max, 0.0)
        factors: Array = 1.0 + (probability**3).sum(axis=1)
        return factors


class RayCaster:
    """Finds the first cell on a ray that is not free.

    Rays pass the cells of Bresenham's line, from the cell of the start to that of the end at the greatest
    range. After k steps along its longer axis, of length a, a line whose other axis has the length b is
    (2kb + a) // 2a cells aside. So a ray can skip cells: if no cell within a distance of k cells (of any of
    the eight directions) stops rays, neither does one of its next k cells.
    """

    def __init__(self, grid: GridMap) -> None:
        self._grid = grid
        free = np.pad(grid.is_free, 1).astype(np.uint8)
        distances = cv2.distanceTransform(free, cv2.DIST_C, cv2.DIST_MASK_3)
        self._clear: NDArray[np.int32] = distances.astype(np.int32)

    def ranges(self, x: Array, y: Array, angles: Array, range_max: float) -> Array:
        """Return the lengths of rays in metres, `range_max` if they end in free cells.

        Args:
            x, y: starts, shape (n,).
            angles: directions in radians, shape (n, m), also the shape of the result.
        """
        row0, column0 = (
            np.broadcast_to(part[:, None], angles.shape).ravel() for part in self._grid.cells(x, y)
        )
        reach = min(range_max, LONGEST_M)
        ends = x[:, None] + reach * np.cos(angles), y[:, None] + reach * np.sin(angles)
        row1, column1 = (part.ravel() for part in self._grid.cells(*ends))
        rows, columns = row1 - row0, column1 - column0
        is_steep = abs(rows) > abs(columns)
        long = np.where(is_steep, abs(rows), abs(columns))
        wide = np.where(is_steep, abs(columns), abs(rows))
        found = np.full(angles.size, range_max)
        step = np.zeros(angles.size, np.int64)
        ray = np.arange(angles.size)
        directions = np.sign(rows), np.sign(columns)
        height, width = self._clear.shape
        while ray.size:
            k, a = step[ray], long[ray]
            aside = (2 * k * wide[ray] + a) // np.maximum(2 * a, 1)
            down = np.where(is_steep[ray], k, aside) * directions[0][ray]
            across = np.where(is_steep[ray], aside, k) * directions[1][ray]
            row = np.clip(row0[ray] + down + 1, 0, height - 1)
            column = np.clip(column0[ray] + across + 1, 0, width - 1)
            clear = self._clear[row, column]
            stops = clear == 0
            found[ray[stops]] = np.hypot(down[stops], across[stops]) * self._grid.resolution
            step[ray] += clear
            ray = ray[~stops & (step[ray] <= a + 1)]
        return found.reshape(angles.shape)
