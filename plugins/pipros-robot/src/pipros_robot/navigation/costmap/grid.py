"""A grid of costs, and the cells on straight lines and in convex polygons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

FREE: Final = 0
INSCRIBED: Final = 253
LETHAL: Final = 254
UNKNOWN: Final = 255

Costs = npt.NDArray[np.uint8]
Points = Sequence[tuple[float, float]]
Numbers = npt.NDArray[Any]

_MOST_CELLS: Final = 2**31  # wider than any grid
_PUBLISHED: Final = np.array(
    [0, *(1 + 97 * (cost - 1) // 251 for cost in range(1, 253)), 99, 100, -1], np.int8
)


class CostGrid:
    """Costs of square cells.

    Attributes:
        costs: the costs by row (y) and column (x), from the lower left corner.
        resolution: metres per cell.
        origin_x, origin_y: the lower left corner of the lower left cell.
        default: the initial cost of cells.
    """

    def __init__(self, default: int = FREE, kind: type = np.uint8) -> None:
        self.default, self._kind = default, kind
        self.resize(0, 0, 1.0, 0.0, 0.0)

    def resize(self, width: int, height: int, resolution: float, origin_x: float, origin_y: float) -> None:
        """Set the size in cells and the position, and set all cells to the default."""
        self.costs: Costs = np.full((height, width), self.default, self._kind)
        self.resolution, self.origin_x, self.origin_y = resolution, origin_x, origin_y

    @property
    def width(self) -> int:
        return int(self.costs.shape[1])

    @property
    def height(self) -> int:
        return int(self.costs.shape[0])

    @property
    def geometry(self) -> tuple[int, int, float, float, float]:
        """The arguments of `resize`."""
        return self.width, self.height, self.resolution, self.origin_x, self.origin_y

    def world_to_cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Return the column and row of a position, or None if it is outside the grid."""
        if not (x >= self.origin_x and y >= self.origin_y):
            return None
        column, row = (x - self.origin_x) / self.resolution, (y - self.origin_y) / self.resolution
        return (int(column), int(row)) if column < self.width and row < self.height else None

    def world_to_cells(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Return the columns and rows of positions, and a mask of the positions inside the grid.

        Positions outside the grid get column 0 and row 0.
        """
        columns: Numbers = (x - self.origin_x) / self.resolution
        rows: Numbers = (y - self.origin_y) / self.resolution
        inside = (columns >= 0) & (rows >= 0) & (columns < self.width) & (rows < self.height)
        if not inside.all():
            columns, rows = np.where(inside, columns, 0), np.where(inside, rows, 0)
        return columns.astype(np.int64), rows.astype(np.int64), inside

    def nearest_cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the column and row of the cell nearest to a position."""
        column = min(max((x - self.origin_x) / self.resolution, 0), self.width - 1)
        row = min(max((y - self.origin_y) / self.resolution, 0), self.height - 1)
        return int(column), int(row)

    def cell_to_world(self, column: Any, row: Any) -> tuple[Any, Any]:
        """Return the centre of a cell, or the centres of cells."""
        x, y = self.origin_x + (column + 0.5) * self.resolution, self.origin_y + (row + 0.5) * self.resolution
        return x, y

    def in_cells(self, distance: float) -> int:
        """Return the smallest number of cells that covers a distance."""
        return max(0, math.ceil(min(distance / self.resolution, _MOST_CELLS)))

    def center_on(self, x: float, y: float) -> None:
        """Move the grid by whole cells to centre it on a position. Keep the overlapping cells.

        As in costmap_2d, the computed centre is a quarter of a cell lower in x and in y than the true centre.
        """
        wide, high = ((size - 0.5) * self.resolution / 2 for size in (self.width, self.height))
        right = int((x - wide - self.origin_x) / self.resolution)
        up = int((y - high - self.origin_y) / self.resolution)
        self.origin_x += right * self.resolution
        self.origin_y += up * self.resolution
        if right or up:
            kept, self.costs = self.costs, np.full_like(self.costs, self.default)
            to_y, from_y = _overlap(up, self.height)
            to_x, from_x = _overlap(right, self.width)
            self.costs[to_y, to_x] = kept[from_y, from_x]

    def published(self, window: tuple[slice, slice] = (slice(None), slice(None))) -> bytes:
        """Return the costs as the data of an OccupancyGrid: 0 to 98, 99 inscribed, 100 lethal, -1 unknown."""
        return bytes(_PUBLISHED[self.costs[window]])

    def fill_polygon(self, corners: Points, cost: int) -> bool:
        """Set the cells in a convex polygon and on its edge. Return False if a corner is outside the grid."""
        cells = [self.world_to_cell(x, y) for x, y in corners]
        inside = [cell for cell in cells if cell is not None]
        if len(inside) < len(cells):
            return False
        if len(cells) >= 3:
            columns, rows = polygon_outline(inside)
            left = int(columns.min())
            low = np.full(int(columns.max()) - left + 1, self.height)
            high = np.full_like(low, -1)
            np.minimum.at(low, columns - left, rows)
            np.maximum.at(high, columns - left, rows)
            for column, (first, last) in enumerate(zip(low, high, strict=True), left):
                self.costs[first : last + 1, column] = cost
        return True


def _overlap(shift: int, size: int) -> tuple[slice, slice]:
    """Return the new and the old indices of the cells that remain when a grid moves by `shift`."""
    kept = max(0, size - abs(shift))
    low, high = slice(0, kept), slice(size - kept, size)
    return (low, high) if shift >= 0 else (high, low)


def polygon_outline(cells: Sequence[tuple[int, int]]) -> tuple[Numbers, Numbers]:
    """Return columns and rows of the cells on a polygon's edges. Cells may occur more than once."""
    x, y = np.array(cells, np.int64).T
    return line_cells(x, y, np.roll(x, -1), np.roll(y, -1))


def line_cells(
    x0: Numbers | int, y0: Numbers | int, x1: Numbers, y1: Numbers, limit: float = math.inf
) -> tuple[Numbers, Numbers]:
    """Return columns and rows of the cells on straight lines, including both ends (Bresenham 1965).

    Lines are cut off at a length of `limit` cells.
    """
    shares = np.minimum(1.0, limit / np.maximum(np.hypot(x1 - x0, y1 - y0), 1e-9))
    columns, rows = _cells_by_axis([x0, y0], [x1 - x0, y1 - y0], shares)
    return columns, rows


def cells_on_lines(first: Numbers, last: Numbers, shares: Numbers) -> Numbers:
    """Return the cells on lines in any number of dimensions; shape (cells, dimensions).

    Args:
        first, last: the ends of each line; all lines may share a single first end.
        shares: the fraction of each line to return, starting at its first end.
    """
    return np.stack(_cells_by_axis(list(first.T), list((last - first).T), shares), axis=1)


def _cells_by_axis(first: list[Any], delta: list[Numbers], shares: Numbers) -> list[Numbers]:
    """Like `cells_on_lines`, but with one array, or number, for each axis, which is faster."""
    longest = np.max([np.abs(each) for each in delta], axis=0)
    counts = (shares * longest).astype(np.int64) + 1
    ends = np.cumsum(counts)
    step = np.arange(counts.sum()) - np.repeat(ends - counts, counts)
    half, most = np.repeat(longest // 2, counts), np.repeat(np.maximum(longest, 1), counts)
    cells = []
    for start, each in zip(first, delta, strict=True):
        # The division of floats is exact enough for lines of 2**24 cells, and faster than that of integers.
        aside = ((half + step * np.repeat(np.abs(each), counts)) / most).astype(np.int64)
        begin = np.repeat(start, counts) if np.ndim(start) else start
        cells.append(begin + np.repeat(np.sign(each), counts) * aside)
    return cells


def shortened(start: Numbers, ends: Numbers, low: Numbers, high: Numbers, inside: Any) -> Numbers:
    """Return the ends of rays after clipping to a box that contains the start; shape (n, dimensions).

    Rays that cross an upper edge (`high`) end `inside` metres before it.
    """
    away = ends - start
    with np.errstate(divide="ignore", invalid="ignore"):
        to_low, to_high = (low - start) / away, (high - inside - start) / away
    parts = np.where(ends < low, to_low, np.where(ends > high, to_high, 1.0))
    found: Numbers = start + away * np.clip(parts.min(axis=1), 0.0, 1.0)[:, None]
    return np.maximum(found, low)  # rounding errors can put an end below the lower edge
