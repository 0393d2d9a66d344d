"""The way down a potential field: half a cell per step along the interpolated gradient."""

from __future__ import annotations

import math

from pipros.navigation.navfn.potential import NEUTRAL, UNREACHED, Cell, Potential

Point = tuple[float, float]

_STEP = 0.5
_IN_OBSTACLE = 254.0
_AROUND = tuple((x, y) for y in (-1, 0, 1) for x in (-1, 0, 1))


class Descent:
    """Follows a field from a cell down to the cell where it is zero. Positions are columns and rows."""

    def __init__(self, field: Potential) -> None:
        self._field = field
        self._height, self._width = field.shape
        self._gradients: dict[Cell, Point] = {}

    def follow(self, first: Cell, last: Cell, limit: int) -> list[Point]:
        """Return the points of the way, at most `limit`; an empty list if there is none.

        Where one of the cells around has no potential, or the way swings, it goes on in the lowest of them.
        """
        (column, row), x, y = first, 0.0, 0.0
        points: list[Point] = []
        for _ in range(limit):
            if self._near(column + round(x), row + round(y)) < NEUTRAL:
                return [*points, (float(last[0]), float(last[1]))]
            if not (0 < column < self._width - 1 and 0 < row < self._height - 1):
                return []
            points.append((column + x, row + y))
            around = self._field[row - 1 : row + 2, column - 1 : column + 2]
            if around.max() >= UNREACHED or (len(points) > 2 and points[-1] == points[-3]):
                lowest = int(around.argmin())
                if around[1, 1] == around.flat[lowest]:
                    lowest = 4
                if around.flat[lowest] >= UNREACHED:
                    return []
                column, row = column + _AROUND[lowest][0], row + _AROUND[lowest][1]
                x = y = 0.0
                continue
            slope_x, slope_y = self._slope(column, row, x, y)
            length = math.hypot(slope_x, slope_y)
            if length == 0:
                return []
            column, x = _carried(column, x + _STEP * slope_x / length)
            row, y = _carried(row, y + _STEP * slope_y / length)
        return []

    def _near(self, column: int, row: int) -> float:
        column = min(max(column, 0), self._width - 1)
        return float(self._field[min(max(row, 0), self._height - 1), column])

    def _slope(self, column: int, row: int, x: float, y: float) -> Point:
        """Return the gradient between the four cells around a position (bilinear interpolation)."""
        corners = (
            ((1 - x) * (1 - y), self._gradient(column, row)),
            (x * (1 - y), self._gradient(column + 1, row)),
            ((1 - x) * y, self._gradient(column, row + 1)),
            (x * y, self._gradient(column + 1, row + 1)),
        )
        return (
            sum(share * gradient[0] for share, gradient in corners),
            sum(share * gradient[1] for share, gradient in corners),
        )

    def _gradient(self, column: int, row: int) -> Point:
        """Return the direction down, with length 1; out of cells that have no potential."""
        found = self._gradients.get((column, row))
        if found is None:
            found = self._gradients[column, row] = self._compute_gradient(column, row)
        return found

    def _compute_gradient(self, column: int, row: int) -> Point:
        if not (0 < column < self._width - 1 and 0 < row < self._height - 1):
            return 0.0, 0.0
        field = self._field
        here = float(field[row, column])
        slopes = []
        for before, after in (
            (float(field[row, column - 1]), float(field[row, column + 1])),
            (float(field[row - 1, column]), float(field[row + 1, column])),
        ):
            if here >= UNREACHED:
                slope = -_IN_OBSTACLE if before < UNREACHED else _IN_OBSTACLE if after < UNREACHED else 0.0
            else:
                slope = (before - here if before < UNREACHED else 0.0) + (
                    here - after if after < UNREACHED else 0.0
                )
            slopes.append(slope)
        length = math.hypot(*slopes)
        return (slopes[0] / length, slopes[1] / length) if length else (0.0, 0.0)


def _carried(cell: int, offset: float) -> tuple[int, float]:
    """Return a cell and an offset of at most one cell."""
    if offset > 1:
        return cell + 1, offset - 1
    if offset < -1:
        return cell - 1, offset + 1
    return cell, offset
