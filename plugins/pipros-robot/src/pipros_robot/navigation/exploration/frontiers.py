"""Find the frontiers of a map: connected unknown cells beside free cells that the robot can reach.

See B. Yamauchi, A frontier-based approach for autonomous exploration, IEEE CIRA, 1997.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.costmap.grid import FREE, UNKNOWN, CostGrid

Mask = NDArray[np.bool_]
Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Frontier:
    """A frontier, in metres.

    Attributes:
        points: the centres of its cells.
        centroid: their mean, to which the robot drives.
        nearest: the point nearest to the robot, and the distance to it.
        cost: the cost; the lowest is visited first.
    """

    points: tuple[Place, ...]
    centroid: Place
    nearest: Place
    distance: float
    cost: float


def frontiers(
    grid: CostGrid, robot: Place, *, potential_scale: float, gain_scale: float, least_m: float
) -> list[Frontier]:
    """Return the frontiers that are at least `least_m` long (cells times resolution), the best first.

    The cost increases with the distance by `potential_scale`, and decreases with the length by `gain_scale`.
    """
    found = []
    near_free = beside(_reachable(grid, robot), diagonally=False)
    cells = set(map(tuple, np.argwhere(near_free & (grid.costs == UNKNOWN)).tolist()))
    while cells:
        part = _taken(cells)
        if len(part) * grid.resolution < least_m:
            continue
        rows, columns = np.array(part).T
        x, y = grid.cell_to_world(columns, rows)
        away = np.hypot(x - robot[0], y - robot[1])
        closest, distance = int(away.argmin()), float(away.min())
        found.append(
            Frontier(
                tuple(zip(x.tolist(), y.tolist(), strict=True)),
                (float(x.mean()), float(y.mean())),
                (float(x[closest]), float(y[closest])),
                distance,
                potential_scale * distance - gain_scale * len(part) * grid.resolution,
            )
        )
    return sorted(found, key=lambda each: each.cost)


def beside(cells: Mask, *, diagonally: bool) -> Mask:
    """Return the cells that are set or have a set neighbour."""
    grown = cells.copy()
    grown[1:] |= cells[:-1]
    grown[:-1] |= cells[1:]
    across = grown.copy() if diagonally else cells
    grown[:, 1:] |= across[:, :-1]
    grown[:, :-1] |= across[:, 1:]
    return grown


def _reachable(grid: CostGrid, robot: Place) -> Mask:
    """Return the free cells that are connected to the free cell nearest to the robot."""
    reached, is_free = np.zeros(grid.costs.shape, bool), grid.costs == FREE
    places = np.argwhere(is_free)
    if not len(places):
        return reached
    x, y = grid.cell_to_world(places[:, 1], places[:, 0])
    start = places[np.hypot(x - robot[0], y - robot[1]).argmin()]
    width = is_free.shape[1] + 2
    free = np.pad(is_free, 1).ravel()
    front = np.array([(start[0] + 1) * width + start[1] + 1])
    steps = np.array([[1], [-1], [width], [-width]])
    flat = np.zeros(free.size, bool)
    flat[front] = True
    while front.size:
        front = np.unique(front + steps)
        front = front[free[front] & ~flat[front]]
        flat[front] = True
    reached[:] = flat.reshape(-1, width)[1:-1, 1:-1]
    return reached


def _taken(cells: set[tuple[int, int]]) -> list[tuple[int, int]]:
    """Remove one connected part, also diagonally, from the set, and return it."""
    part = [cells.pop()]
    for row, column in part:  # grows while it is read
        for beside_row in (row - 1, row, row + 1):
            for beside_column in (column - 1, column, column + 1):
                if (beside_row, beside_column) in cells:
                    cells.discard((beside_row, beside_column))
                    part.append((beside_row, beside_column))
    return part


def is_near(one: Place, other: Place, tolerance: float) -> bool:
    """Return whether two places differ by less than `tolerance` in x and in y."""
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) < tolerance and all(map(math.isfinite, one))
