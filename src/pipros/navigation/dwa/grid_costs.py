"""Distances on the grid to the plan and to the goal, and costs under the outline of the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipros.navigation.costmap.grid import INSCRIBED, LETHAL, UNKNOWN, CostGrid

Cells = NDArray[np.int64]
Point = tuple[float, float]
Array = NDArray[np.float64]

COLLISION, UNKNOWN_UNDER, OUTSIDE = -1, -2, -3
"""Results for a pose in collision, over unknown cells, and with a corner off the map."""


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

    A wave over 4-neighbours counts cells from the targets outwards. Obstacles (inscribed, lethal and unknown
    cells) stop it: they have the number of cells as their value, cells that it does not reach one more.
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


def outline_costs(
    grid: CostGrid, footprint: Sequence[tuple[float, float]], x: Array, y: Array, yaw: Array
) -> NDArray[np.int64]:
    """Return the greatest cost on the outline for each pose, or a negative result.

    The edges are drawn with Bresenham's algorithm between the cells of the corners. With fewer than three
    corners, the cell of the centre counts alone, and an inscribed cell is a collision as well.

    Args:
        footprint: the corners in the robot's frame.
        x, y, yaw: the poses, shape (n,).
    """
    cosine, sine = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    corners = np.array(footprint if len(footprint) >= 3 else [(0.0, 0.0)])
    column, row, inside = grid.world_to_cells(
        x[:, None] + corners[:, 0] * cosine - corners[:, 1] * sine,
        y[:, None] + corners[:, 0] * sine + corners[:, 1] * cosine,
    )
    outside = ~inside.all(axis=1)
    column[outside] = row[outside] = 0
    costs = grid.costs.ravel()
    if len(footprint) < 3:
        highest = costs[row[:, 0] * grid.costs.shape[1] + column[:, 0]].astype(np.int64)
        result = np.where((highest >= INSCRIBED) & (highest != UNKNOWN), COLLISION, highest)
    else:
        result = _worst_on_lines(costs, grid.costs.shape[1], column, row, footprint, grid.resolution)
    result[result == UNKNOWN] = UNKNOWN_UNDER
    result[outside] = OUTSIDE
    return result


def _worst_on_lines(
    costs: NDArray[np.uint8],
    columns: int,
    x: NDArray[np.int64],
    y: NDArray[np.int64],
    footprint: Sequence[tuple[float, float]],
    resolution: float,
) -> NDArray[np.int64]:
    """Return the result for the closed lines through these cells."""
    worst = np.zeros(len(x), np.uint8)
    is_unknown = np.zeros(len(x), bool)
    for this in range(x.shape[1]):
        following = (this + 1) % x.shape[1]
        across, up = x[:, following] - x[:, this], y[:, following] - y[:, this]
        width, height = np.abs(across), np.abs(up)
        is_steep = height > width
        long, short = np.maximum(width, height), np.minimum(width, height)
        major = np.where(is_steep, np.sign(up) * columns, np.sign(across))
        minor = np.where(is_steep, np.sign(across), np.sign(up) * columns)
        start = y[:, this] * columns + x[:, this]
        length = math.dist(footprint[this], footprint[following])
        steps = np.arange(min(math.ceil(length / resolution) + 2, int(long.max(initial=0)) + 1))
        steps = np.minimum(steps[:, None], long)
        aside = (long // 2 + steps * short) // np.maximum(long, 1)
        found = costs[start + steps * major + aside * minor]
        is_unknown |= (found == UNKNOWN).any(axis=0)
        worst = np.maximum(worst, np.where(found == UNKNOWN, 0, found).max(axis=0))
    result = worst.astype(np.int64)
    result[worst == LETHAL] = COLLISION
    result[is_unknown] = UNKNOWN
    return result
