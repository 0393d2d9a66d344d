"""Occupancy grids at several resolutions, and the pose at which a scan fits them.

The probabilities between cells are interpolated, and Gauss-Newton steps climb them, first in coarse grids
(S. Kohlbrecher et al., A Flexible and Scalable SLAM System with Full 3D Motion Estimation, IEEE International
Symposium on Safety, Security and Rescue Robotics, 2011). Points are complex numbers x + iy, in metres.
"""

from __future__ import annotations

import cmath
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.costmap.grid import line_cells
from pipros_robot.navigation.costmap.obstacle_layer import RAYS_AT_ONCE
from pipros_robot.navigation.plane import Triple

Array = NDArray[np.float64]
Places = NDArray[np.complex128]

_MOST: Final = 50.0
"""Maximum of the logarithm of the odds that a cell is occupied."""
_STEPS: Final = 8
"""Gauss-Newton steps in each grid."""
_MOST_TURN: Final = 0.2
_LEAST_INFORMATION: Final = 1e-6
_NEVER: Final = 1e-9


class OccupancyGrid:
    """A square grid of the logarithms of the odds that cells are occupied; 0 means unknown.

    Attributes:
        odds: the logarithms, shape (rows, columns).
        resolution: metres per cell.
        origin: the lower left corner.
    """

    def __init__(self, size: int, resolution: float, origin: complex, free: float, occupied: float) -> None:
        """Start with unknown cells. `free` and `occupied` are the probabilities after one beam."""
        self.odds = np.zeros((size, size), np.float32)
        self.resolution, self.origin = resolution, origin
        self._free, self._occupied = (math.log(each / (1 - each)) for each in (free, occupied))

    def add(self, pose: Triple, points: Places) -> None:
        """Add a scan. Cells with the end of a beam become more occupied; others on beams become freer."""
        x, y, yaw = pose
        size = self.odds.shape[0]
        start = (complex(x, y) - self.origin) / self.resolution
        ends = start + points * (cmath.exp(1j * yaw) / self.resolution)
        is_near = (np.abs(ends.real) < 4 * size) & (np.abs(ends.imag) < 4 * size)
        columns, rows = (np.floor(part[is_near]).astype(np.int64) for part in (ends.real, ends.imag))
        first = math.floor(start.real), math.floor(start.imag)
        if not (len(columns) and all(0 <= each < size for each in first)):
            return
        ended = self._inside(columns, rows)
        flat, passed = self.odds.reshape(-1), np.zeros(size * size, bool)
        for at in range(0, len(columns), RAYS_AT_ONCE):
            part = slice(at, at + RAYS_AT_ONCE)
            passed[self._inside(*line_cells(*first, columns[part], rows[part]))] = True
        passed[ended] = False
        flat[passed] += np.float32(self._free)
        flat[ended] = np.minimum(flat[ended] + np.float32(self._occupied), np.float32(_MOST))

    def _inside(self, columns: Any, rows: Any) -> NDArray[np.int64]:
        size = self.odds.shape[0]
        inside = (columns >= 0) & (rows >= 0) & (columns < size) & (rows < size)
        cells: NDArray[np.int64] = np.unique(rows[inside] * size + columns[inside])
        return cells

    def climbed(self, pose: Triple, points: Places) -> tuple[Triple, Array]:
        """Return a pose at which points are on more probably occupied cells, and its information matrix."""
        information = np.zeros((3, 3))
        for _ in range(_STEPS):
            x, y, yaw = pose
            turned = points * cmath.exp(1j * yaw)
            values, across, up = self._interpolated(turned + complex(x, y))
            by_turn = up * turned.real - across * turned.imag
            slopes = np.stack((across, up, by_turn), axis=1)
            information = slopes.T @ slopes
            if np.linalg.eigvalsh(information)[0] < _LEAST_INFORMATION:
                break
            step = np.linalg.solve(information, slopes.T @ (1.0 - values))
            step[2] = min(max(step[2], -_MOST_TURN), _MOST_TURN)
            far = float(np.abs(step[:2]).max()) / (2 * self.resolution)
            step[:2] /= max(far, 1.0)
            pose = x + float(step[0]), y + float(step[1]), yaw + float(step[2])
            if np.abs(step).max() < _NEVER:
                break
        return pose, information

    def _interpolated(self, places: Places) -> tuple[Array, Array, Array]:
        """Return the probabilities at places, and their slopes along x and y per metre; 0 outside."""
        cells, size = (places - self.origin) / self.resolution - (0.5 + 0.5j), self.odds.shape[0]
        column, row = np.floor(cells.real), np.floor(cells.imag)
        inside = (column >= 0) & (row >= 0) & (column < size - 1) & (row < size - 1)
        column, row = np.where(inside, column, 0), np.where(inside, row, 0)
        right, above = np.where(inside, cells.real - column, 0.0), np.where(inside, cells.imag - row, 0.0)
        index = (row * size + column).astype(np.int64)
        odds = self.odds.reshape(-1)
        low_left, low_right, high_left, high_right = (
            1.0 / (1.0 + np.exp(-odds[index + offset].astype(float))) for offset in (0, 1, size, size + 1)
        )
        low, high = low_left + right * (low_right - low_left), high_left + right * (high_right - high_left)
        across = (1 - above) * (low_right - low_left) + above * (high_right - high_left)
        scale = np.where(inside, 1.0 / self.resolution, 0.0)
        return np.where(inside, low + above * (high - low), 0.5), across * scale, (high - low) * scale


class OccupancyPyramid:
    """Grids of the same area, each with half the resolution of the one before. Not thread-safe.

    Attributes:
        grids: the grids, the finest first.
    """

    def __init__(
        self, levels: int, size: int, resolution: float, origin: complex, free: float, occupied: float
    ) -> None:
        self.grids = [
            OccupancyGrid(max(1, size >> level), resolution * (1 << level), origin, free, occupied)
            for level in range(levels)
        ]

    def matched(self, guess: Triple, points: Places) -> tuple[Triple, Array]:
        """Return the pose near the guess at which the points fit the map, and its information matrix."""
        pose, information = guess, np.zeros((3, 3))
        for grid in reversed(self.grids):
            pose, information = grid.climbed(pose, points)
        return (pose[0], pose[1], math.remainder(pose[2], math.tau)), information

    def add(self, pose: Triple, points: Places) -> None:
        """Add a scan to all grids."""
        for grid in self.grids:
            grid.add(pose, points)

    def values(self) -> NDArray[np.int8]:
        """Return the finest grid: -1 unknown, 0 free, 100 occupied."""
        odds = self.grids[0].odds
        found: NDArray[np.int8] = np.where(odds > 0, 100, np.where(odds < 0, 0, -1)).astype(np.int8)
        return found
