"""Distances on the grid to the plan and to the goal.

A wave over 4-neighbours counts cells from the targets outwards. Obstacles (inscribed, lethal and unknown
cells) stop it: they have the number of cells as their value, cells that the wave does not reach one more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipros.navigation.costmap.grid import INSCRIBED, UNKNOWN, CostGrid

Cells = NDArray[np.int64]
Point = tuple[float, float]


def plan_cells(grid: CostGrid, plan: Sequence[Point]) -> Cells:
    """Return the cells of a plan inside the map, up to its first exit, shape (n, 2): row and column.

    The plan is filled in to the resolution. An unknown cell counts as outside.
    """
    if not plan:
        return np.empty((0, 2), np.int64)
    points = np.array(_filled(plan, grid.resolution))
    x, y, inside = grid.world_to_cells(points[:, 0], points[:, 1])
    inside &= grid.costs[y, x] != UNKNOWN
    if not inside.any():
        return np.empty((0, 2), np.int64)
    first = int(inside.argmax())
    exits = np.flatnonzero(~inside[first:])
    last = first + int(exits[0]) if exits.size else len(inside)
    return np.column_stack((y[first:last], x[first:last]))


def _filled(plan: Sequence[Point], resolution: float) -> list[Point]:
    points = [plan[0]]
    for x, y in plan[1:]:
        before_x, before_y = points[-1]
        steps = math.ceil(math.hypot(x - before_x, y - before_y) / resolution)
        points += [
            (before_x + (x - before_x) * step / steps, before_y + (y - before_y) * step / steps)
            for step in range(1, steps)
        ]
        points.append((x, y))
    return points


def waves(grid: CostGrid, targets: Sequence[Cells]) -> NDArray[np.int64]:
    """Return the distances, in cells, to each of the sets of targets, shape (sets, rows, columns).

    All waves advance together, in one array with a border around each map.
    """
    rows, columns = grid.costs.shape
    is_blocked = np.ones((len(targets), rows + 2, columns + 2), bool)
    is_blocked[:, 1:-1, 1:-1] = grid.costs >= INSCRIBED
    cells, unseen = rows * columns, rows * columns + 1
    distance = np.full(is_blocked.shape, unseen)
    for layer, found in zip(distance, targets, strict=True):
        layer[found[:, 0] + 1, found[:, 1] + 1] = 0
    flat, blocked, mark = distance.ravel(), is_blocked.ravel(), np.zeros(distance.size, np.int64)
    neighbours = np.array([[1], [-1], [columns + 2], [-columns - 2]])
    front, reached = np.flatnonzero(flat == 0), 0
    while front.size:
        reached += 1
        following = (front + neighbours).ravel()
        following = following[flat[following] == unseen]
        is_wall = blocked[following]
        flat[following[is_wall]] = cells
        following = following[~is_wall]
        flat[following] = reached
        mark[following] = order = np.arange(following.size)
        front = following[mark[following] == order]
    return distance[:, 1:-1, 1:-1]
