"""The map for localisation, as arrays."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Cells = NDArray[np.int64]


class GridMap:
    """An occupancy grid. As in amcl, the cell (0, 0) is centred on the origin.

    Attributes:
        is_free, is_occupied: masks, shape (rows, columns). Cells with values other than 0 or 100 are neither
            free nor occupied.
        resolution: metres per cell.
        origin: x and y of the centre of the first cell.
    """

    def __init__(self, values: NDArray[np.int8], resolution: float, origin: tuple[float, float]) -> None:
        """Store a map. `values` has the shape (rows, columns); the first row has the lowest y."""
        self.is_free = values == 0
        self.is_occupied = values == 100
        self.resolution = resolution
        self.origin = origin
        self._free = np.argwhere(self.is_free)

    @property
    def shape(self) -> tuple[int, int]:
        """The number of rows and of columns."""
        rows, columns = self.is_free.shape
        return rows, columns

    def cells(self, x: Array, y: Array) -> tuple[Cells, Cells]:
        """Return the rows and columns of points. Points may lie outside the map."""
        scale, (left, bottom) = 1.0 / self.resolution, self.origin
        columns = np.floor((x - left) * scale + 0.5).astype(np.int64)
        return np.floor((y - bottom) * scale + 0.5).astype(np.int64), columns

    def look_up(self, padded: Array, x: Array, y: Array) -> Array:
        """Return the values at points, from a table with a border of one cell for points outside the map."""
        rows, columns = padded.shape
        scale, (left, bottom) = 1.0 / self.resolution, self.origin
        # Adding 1.5 instead of 0.5 before rounding down skips the border. Clipping before the conversion
        # keeps the numbers positive, so the conversion rounds down.
        column = np.clip((x - left) * scale + 1.5, 0, columns - 1).astype(np.int64)
        row = np.clip((y - bottom) * scale + 1.5, 0, rows - 1).astype(np.int64)
        row *= columns
        row += column
        found: Array = padded.ravel().take(row)
        return found

    def obstacle_distances(self, limit: float) -> Array:
        """Return the distances from cells to the nearest occupied cell in metres, at most `limit`.

        The result has a border of one cell with the value `limit`.
        """
        distances = np.full(self.shape, np.inf)
        if self.is_occupied.any():
            blank = np.where(self.is_occupied, 0, 1).astype(np.uint8)
            distances = cv2.distanceTransform(blank, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(float)
        inner = np.minimum(distances * self.resolution, limit)
        return np.pad(inner, 1, constant_values=limit)

    def random_poses(self, count: int, rng: np.random.Generator) -> Array:
        """Return poses with random yaws in random free cells, or at (0, 0) if no cell is free."""
        poses = np.zeros((count, 3))
        poses[:, 2] = rng.uniform(-np.pi, np.pi, count)
        if len(self._free):
            chosen = self._free[rng.integers(len(self._free), size=count)]
            poses[:, :2] = chosen[:, ::-1] * self.resolution + self.origin
        return poses
