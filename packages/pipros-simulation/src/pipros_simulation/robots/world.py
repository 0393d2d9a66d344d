"""The walls of a world: the occupied cells of a grid, prepared for ray casting and collision checks.

Positions are in metres in the map frame, x to the right and y up. Arrays of cells have the shape (rows,
columns), with row 0 at the lowest y. Unknown cells count as free. A robot cannot leave the grid, and a laser
beam that leaves it returns no echo.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_libraries.maps.map_file import Grid
from pipros_simulation.robots.errors import InvalidSettings

OCCUPIED_FROM: Final = 65
"""Map cells with at least this value are walls; lower values, and -1, are free."""
WALL: Final = -1
OUTSIDE: Final = -2
LONGEST_JUMP: Final = 128

Jumps = NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """The walls of a world.

    Attributes:
        jumps: for each cell, and for a border of one cell around the grid: WALL, OUTSIDE, or a distance
            in cells within which all cells are free, in all directions including diagonals.
        resolution: metres per cell.
        left, bottom: position of the lower left corner of the grid, excluding the border.
    """

    jumps: Jumps
    resolution: float
    left: float
    bottom: float

    @classmethod
    def from_cells(
        cls, occupied: NDArray[np.bool_], resolution: float, corner: tuple[float, float] = (0.0, 0.0)
    ) -> World:
        """Create a world from its occupied cells.

        Args:
            occupied: array of shape (rows, columns), row 0 at the lowest y.
            resolution: metres per cell.
            corner: x and y of the lower left corner.
        """
        return cls(_free_distances(occupied), resolution, *corner)

    @classmethod
    def from_grid(cls, grid: Grid) -> World:
        """Create a world from a map.

        Raises:
            InvalidSettings: the map is rotated.
        """
        x, y, yaw = grid.description.origin
        if yaw:
            raise InvalidSettings(f"the yaw of the map's origin must be 0, got {yaw}")
        cells = np.frombuffer(grid.cells, np.int8).reshape(grid.height, grid.width)
        return cls.from_cells(cells >= OCCUPIED_FROM, grid.description.resolution, (x, y))

    @property
    def walls(self) -> NDArray[np.bool_]:
        """The occupied cells, excluding the border."""
        walls: NDArray[np.bool_] = self.jumps[1:-1, 1:-1] == WALL
        return walls

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in metres."""
        rows, columns = self.jumps.shape
        return (columns - 2) * self.resolution, (rows - 2) * self.resolution

    def is_free(self, x: float, y: float, radius: float) -> bool:
        """Return True if a disc touches neither a wall nor the edge of the grid."""
        column, row = (x - self.left) / self.resolution + 1, (y - self.bottom) / self.resolution + 1
        reach = radius / self.resolution
        rows, columns = self.jumps.shape
        if not (1 + reach <= column <= columns - 1 - reach and 1 + reach <= row <= rows - 1 - reach):
            return False
        if self.jumps[int(row), int(column)] >= reach:
            return True
        first_row, first_column = int(row - reach), int(column - reach)
        near = self.jumps[first_row : int(row + reach) + 1, first_column : int(column + reach) + 1] == WALL
        # the point in each cell that is closest to the centre of the disc
        below = first_row + np.arange(near.shape[0])
        before = first_column + np.arange(near.shape[1])
        up = row - np.clip(row, below, below + 1)
        across = column - np.clip(column, before, before + 1)
        is_touched = near & (up[:, None] ** 2 + across[None, :] ** 2 < reach**2)
        return not bool(is_touched.any())

    def free_cells(self) -> NDArray[np.float64]:
        """Return the centres of all free cells as an array of shape (n, 2)."""
        rows, columns = np.nonzero(self.jumps[1:-1, 1:-1] >= 0)
        return np.column_stack(
            (
                self.left + (columns + 0.5) * self.resolution,
                self.bottom + (rows + 0.5) * self.resolution,
            )
        )


def _free_distances(occupied: NDArray[np.bool_]) -> Jumps:
    """Return the value of `World.jumps`.

    The cells blocked within a distance of 2r are those blocked within r, shifted by -r, 0 and r along both
    axes, so each of the distances 1, 2, 4, … needs one pass.
    """
    bordered = np.pad(occupied, 1, constant_values=True)
    jumps = np.zeros(bordered.shape, np.int16)
    near, distance = _grown(bordered, 1), 1
    while distance <= LONGEST_JUMP and not near.all():
        jumps[~near] = distance
        near, distance = _grown(near, distance), 2 * distance
    jumps[bordered] = OUTSIDE
    jumps[1:-1, 1:-1][occupied] = WALL
    return jumps


def _grown(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Return a copy of a mask in which the cells at an offset of exactly `by` from a set cell are also set.

    The offset is along one axis or both.
    """
    rows = cells.copy()
    rows[by:] |= cells[:-by]
    rows[:-by] |= cells[by:]
    grown = rows.copy()
    grown[:, by:] |= rows[:, :-by]
    grown[:, :-by] |= rows[:, by:]
    return grown
