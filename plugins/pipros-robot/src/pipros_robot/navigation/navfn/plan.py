"""Plan a path over costs: `plan(costs, start, goal)`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pipros_robot.navigation.costmap.grid import Costs
from pipros_robot.navigation.costmap.layered import CellRectangle
from pipros_robot.navigation.navfn.potential import (
    NEUTRAL,
    UNREACHED,
    Cell,
    Potential,
    crossing_costs,
    spread,
)

Point = tuple[float, float]

_STEP = 0.5
_IN_OBSTACLE = 254.0
_AROUND = tuple((x, y) for y in (-1, 0, 1) for x in (-1, 0, 1))
_LEAST_CELLS = 60
_LEAST_SHARE = 0.95
"""A potential is at least this share of the straight distance times the cost of free cells."""


class Descent:
    """Descends a potential field to its minimum in steps of half a cell. Positions are columns and rows."""

    def __init__(self, field: Potential) -> None:
        self._field = field
        self._height, self._width = field.shape
        self._gradients: dict[Cell, Point] = {}

    def follow(self, first: Cell, last: Cell, limit: int) -> list[Point]:
        """Return the points of the path, or an empty list if there is no path of at most `limit` points.

        If a neighbouring cell has no potential, or the path oscillates, it continues at the neighbour with
        the lowest potential.
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
        """Return the gradient at a position, interpolated bilinearly between the four cells around it."""
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
        """Return the unit vector of steepest descent. In a cell without a potential, it points outwards."""
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


@dataclass(frozen=True, slots=True)
class PotentialField:
    """The potentials around a start, in a part of the map.

    Attributes:
        start: column and row in the map.
        window: the part of the map.
        values: potentials by row and column of the part.
    """

    start: Cell
    window: CellRectangle
    values: Potential

    def potential(self, cell: Cell) -> float:
        """Return the potential of a cell in the map, or `UNREACHED` outside the part."""
        x, y = cell[0] - self.window.x0, cell[1] - self.window.y0
        height, width = self.values.shape
        return float(self.values[y, x]) if 0 <= x < width and 0 <= y < height else UNREACHED

    def path_to(self, goal: Cell, limit: int) -> list[Point]:
        """Return the path from the start to a cell, or an empty list if it has more than `limit` points.

        The list is also empty if there is no path. Points are columns and rows of the map.
        """
        x0, y0 = self.window.x0, self.window.y0
        first, last = (goal[0] - x0, goal[1] - y0), (self.start[0] - x0, self.start[1] - y0)
        down = Descent(self.values).follow(first, last, limit)
        return [(x + x0, y + y0) for x, y in reversed(down)]


def plan(
    costs: Costs, start: Cell, goal: Cell, *, allow_unknown: bool = True, use_astar: bool = False
) -> list[Point]:
    """Return the cheapest path as columns and rows (floats), or an empty list if there is none.

    Args:
        costs: costs by row and column, from 0 to 255, as in `pipros_robot.navigation.costmap`.
        start, goal: column and row of cells in the map.
        allow_unknown: whether unknown cells can be crossed.
        use_astar: see `spread`.
    """
    field = find_field(costs, start, goal, allow_unknown=allow_unknown, use_astar=use_astar)
    return field.path_to(goal, 4 * costs.shape[1]) if field.potential(goal) < UNREACHED else []


def find_field(
    costs: Costs, start: Cell, goal: Cell, *, allow_unknown: bool = True, use_astar: bool = False
) -> PotentialField:
    """Return the potentials that determine the cheapest path to the goal.

    The region around start and goal is searched first. If every path that leaves the region must cost more
    than the path found in it, this path is the cheapest. Otherwise, the whole map is searched.
    """
    height, width = costs.shape
    whole = CellRectangle(0, 0, width, height)
    for window in (_region(start, goal, whole), whole):
        crossing = crossing_costs(costs[window.slices], allow_unknown=allow_unknown)
        ends = [(cell[0] - window.x0, cell[1] - window.y0) for cell in (start, goal)]
        field = PotentialField(start, window, spread(crossing, ends[0], ends[1], use_astar=use_astar))
        if window == whole or field.potential(goal) <= _way_outside(start, goal, window, whole):
            break
    return field


def _region(start: Cell, goal: Cell, whole: CellRectangle) -> CellRectangle:
    left, right = sorted((start[0], goal[0]))
    low, high = sorted((start[1], goal[1]))
    margin = max(_LEAST_CELLS, (right - left + high - low) // 4)
    region = CellRectangle(
        max(0, left - margin),
        max(0, low - margin),
        min(whole.xn, right + margin + 1),
        min(whole.yn, high + margin + 1),
    )
    area = (region.xn - region.x0) * (region.yn - region.y0)
    return region if 2 * area <= whole.xn * whole.yn else whole


def _way_outside(start: Cell, goal: Cell, window: CellRectangle, whole: CellRectangle) -> float:
    """Return a lower bound on the potential of a path that leaves the region within the map."""
    across, along = abs(start[0] - goal[0]), abs(start[1] - goal[1])
    edges = (
        (window.x0 > whole.x0, start[0] + goal[0] - 2 * window.x0, along),
        (window.xn < whole.xn, 2 * window.xn - start[0] - goal[0], along),
        (window.y0 > whole.y0, start[1] + goal[1] - 2 * window.y0, across),
        (window.yn < whole.yn, 2 * window.yn - start[1] - goal[1], across),
    )
    lengths = [math.hypot(there_and_back, aside) for is_inner, there_and_back, aside in edges if is_inner]
    return _LEAST_SHARE * NEUTRAL * min(lengths, default=math.inf)


def _carried(cell: int, offset: float) -> tuple[int, float]:
    """Return the cell and the offset, after carrying over one cell if the offset exceeds one cell."""
    if offset > 1:
        return cell + 1, offset - 1
    if offset < -1:
        return cell - 1, offset + 1
    return cell, offset
