"""Compute distances on the grid to the plan and to the goal, and costs under the robot's outline."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.costmap.grid import INSCRIBED, LETHAL, UNKNOWN, CostGrid, Costs

Cells = NDArray[np.int64]
Array = NDArray[np.float64]
Points: TypeAlias = Sequence[tuple[float, float]] | Array
"""Positions, one by one or as an array of shape (n, 2)."""

KNOWN_LINES = 10_000
"""Maximum number of lines that are kept for one length of edges: some 4 MB."""
COLLISION, UNKNOWN_UNDER, OUTSIDE = -1, -2, -3
"""Results for a pose in collision, over unknown cells, and with a corner off the map."""


def plan_cells(grid: CostGrid, plan: Points) -> Cells:
    """Return the cells of a plan inside the map, up to its first exit; shape (n, 2), row and column.

    Points are inserted where points of the plan are farther apart than the resolution. Unknown cells count as
    outside the map.
    """
    if not len(plan):
        return np.empty((0, 2), np.int64)
    x, y, inside = grid.world_to_cells(*_filled(np.asarray(plan), grid.resolution).T)
    inside &= grid.costs[y, x] != UNKNOWN
    if not inside.any():
        return np.empty((0, 2), np.int64)
    first = int(inside.argmax())
    exits = np.flatnonzero(~inside[first:])
    last = first + int(exits[0]) if exits.size else len(inside)
    return np.column_stack((y[first:last], x[first:last]))


def _filled(points: Array, resolution: float) -> Array:
    """Insert points so that neighbours are at most `resolution` apart. Return all points."""
    apart = np.diff(points, axis=0)
    counts = np.maximum(np.ceil(np.hypot(*apart.T) / resolution), 1).astype(np.int64)
    line, ends = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts)
    step = (np.arange(len(line)) - (ends - counts)[line] + 1)[:, None]
    filled = points[line] + apart[line] * step / counts[line, None]
    filled[ends - 1] = points[1:]
    return np.concatenate((points[:1], filled))


def waves(grid: CostGrid, targets: Sequence[Cells]) -> NDArray[np.int64]:
    """Return the distance from each cell to each set of targets, in cells; shape (sets, rows, columns).

    A wave over 4-neighbours counts cells from the targets outwards. Obstacles (inscribed, lethal and unknown
    cells) stop it. Obstacles that it reaches get the value rows * columns, and unreached cells one more. All
    waves advance together, in one array with a border around each map.
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
    grid: CostGrid, footprint: Points, x: Array, y: Array, yaw: Array, growth: Array | None = None
) -> NDArray[np.int64]:
    """Return the greatest cost on the outline for each pose, or a negative number such as `COLLISION`.

    The edges are drawn with Bresenham's algorithm between the cells of the corners. With fewer than three
    corners, only the cell of the centre counts, and an inscribed cell is also a collision.

    Args:
        footprint: the corners in the robot's frame.
        x, y, yaw: the poses, shape (n,).
        growth: the factors by which the footprint is enlarged, by pose; 1 if None.
    """
    result = np.zeros(len(x), np.int64)
    if len(x):
        columns, rows, inside = grid.world_to_cells(x, y)
        factors = np.ones(len(x)) if growth is None else growth
        radius = max((float(np.hypot(*corner)) for corner in footprint), default=0.0)
        reach = grid.in_cells(radius * float(factors.max())) + 1
        near = np.flatnonzero(~inside | _are_near_costs(grid.costs, rows, columns, reach))
        result[near] = _outline_costs(grid, footprint, x[near], y[near], yaw[near], factors[near])
    return result


def _are_near_costs(costs: Costs, rows: Cells, columns: Cells, reach: int) -> NDArray[np.bool_]:
    """Return which cells have a cost > 0, or the end of the map, within `reach` cells along both axes."""
    low, left = max(0, int(rows.min()) - reach), max(0, int(columns.min()) - reach)
    part = costs[low : int(rows.max()) + reach + 1, left : int(columns.max()) + reach + 1]
    has_cost = np.pad(part > 0, reach, constant_values=True)
    sums, side = np.pad(has_cost, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1), 2 * reach + 1
    counts = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    found: NDArray[np.bool_] = counts[rows - low, columns - left] > 0
    return found


def _outline_costs(
    grid: CostGrid, footprint: Points, x: Array, y: Array, yaw: Array, growth: Array
) -> NDArray[np.int64]:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    has_outline = len(footprint) >= 3
    corners = np.array(footprint if has_outline else [(0.0, 0.0)])
    factor = growth if (growth != growth[:1]).any() else growth[:1]
    column, row = cells = np.empty((2, len(corners), len(x)), np.int64)
    outside = np.zeros(len(x), bool)
    for k, (forwards, left) in enumerate(corners):  # one by one, so that the arrays stay in the cache
        a, b = factor * forwards, factor * left
        column[k], row[k], inside = grid.world_to_cells(x + a * cosine - b * sine, y + a * sine + b * cosine)
        outside |= ~inside
    cells[:, :, outside] = 0
    edges = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T) * growth.max(initial=0.0)
    longest = (edges / grid.resolution + 1e-6).astype(np.int64) + 1
    worst = _worst_on_lines(grid.costs, column, row, longest)
    result = worst.astype(np.int64)
    result[worst >= (LETHAL if has_outline else INSCRIBED)] = COLLISION
    result[worst == UNKNOWN] = UNKNOWN_UNDER  # UNKNOWN is the greatest cost
    result[outside] = OUTSIDE
    return result


def _worst_on_lines(costs: Costs, x: Cells, y: Cells, longest: Cells) -> Costs:
    """Return the greatest cost on each closed polyline through cells. `x` and `y` have shape (corners, n).

    `longest` is the maximum number of columns, and of rows, from one end of each edge to the other.
    """
    columns, flat, reach = costs.shape[1], costs.ravel(), int(longest.max())
    pitch = 2 * reach + 1
    known = _lines_within(reach, columns) if pitch**2 <= KNOWN_LINES else None
    worst, cells, numbers = np.zeros(x.shape[1], np.uint8), y * columns + x, y * pitch + x
    for this, most in enumerate(longest):
        following = (this + 1) % len(x)
        which: Cells | slice = slice(None)
        if known is not None:
            lines, which = known[:most], numbers[following] - numbers[this]
        else:
            lines = _lines(x[following] - x[this], y[following] - y[this], int(most), columns)
        start = cells[this]
        for offsets in lines:
            np.maximum(worst, flat[start + offsets[which]], out=worst)
    return worst


@lru_cache(maxsize=16)
def _lines_within(reach: int, columns: int) -> Cells:
    """Return the lines to all cells that are at most `reach` rows and columns away; see `_lines`.

    The line to a cell is at `up * (2 * reach + 1) + across`, counted from the end if this is negative.
    """
    side = np.arange(-reach, reach + 1)
    up, across = (each.ravel() for each in np.meshgrid(side, side, indexing="ij"))
    return np.roll(_lines(across, up, reach, columns), -(len(up) // 2), axis=1)


def _lines(across: Cells, up: Cells, most: int, columns: int) -> Cells:
    """Return the cells on lines, without the first, as differences of indices in a flat grid.

    The lines end `across` columns and `up` rows away, both at most `most`. The result has shape (most, n).
    """
    width, height = np.abs(across), np.abs(up)
    is_steep = height > width
    long, short = np.maximum(width, height), np.minimum(width, height)
    major = np.where(is_steep, np.sign(up) * columns, np.sign(across))
    minor = np.where(is_steep, np.sign(across), np.sign(up) * columns)
    steps = np.minimum(np.arange(1, min(most, int(long.max(initial=1))) + 1)[:, None], long)
    aside = (long // 2 + steps * short) // np.maximum(long, 1)
    lines: Cells = steps * major + aside * minor
    return lines
