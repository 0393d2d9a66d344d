"""The potential field of navfn: for each cell, the cost of the cheapest path from the start.

Konolige, "A Gradient Method for Realtime Robot Control", IROS 2000. Let a <= b be the potentials of a cell's
cheapest neighbours in x and in y. Then the potential p of the cell, whose cost is h, is computed as if a
straight wave crossed it:

    p = a + h                                     if b - a >= h
    p = a + h (-0.2301 q² + 0.5307 q + 0.7040)    otherwise, with q = (b - a) / h

The wave spreads in batches of cells. All cells of a batch are computed at once, and then once more, because
they depend on each other. The potentials differ by at most half a percent from potentials computed cell by
cell with a queue. Cells with potentials above a threshold wait until all cells below it are done. Then the
threshold rises by the cost of two free cells.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from pipros_robot.navigation.costmap.grid import INSCRIBED, UNKNOWN, Costs

Potential = npt.NDArray[np.float32]
Cell = tuple[int, int]

UNREACHED: Final = 1e10
"""The potential of a cell that the wave has not reached."""

NEUTRAL: Final = 50.0
"""The cost of crossing a free cell."""

_BLOCKED: Final = 254.0
_FIRST_THRESHOLD: Final = 254.0
_NEVER: Final = 1e20
_LEAST_GAIN: Final = math.sqrt(0.5)
"""A neighbour is recomputed if its potential exceeds a cell's by this share of the neighbour's cost."""


def crossing_costs(costs: Costs, *, allow_unknown: bool) -> Potential:
    """Return the cost of crossing each cell, from 50 to 253, and 254 for cells that cannot be crossed.

    Inscribed and lethal cells and the border of the map cannot be crossed. Unknown cells can be crossed if
    `allow_unknown` is true.
    """
    table = np.full(256, _BLOCKED, np.float32)
    table[:INSCRIBED] = np.minimum(NEUTRAL + np.floor(np.arange(INSCRIBED) * 0.8), _BLOCKED - 1)
    table[UNKNOWN] = _BLOCKED - 1 if allow_unknown else _BLOCKED
    crossing = table[costs]
    crossing[[0, -1]] = crossing[:, [0, -1]] = _BLOCKED
    return crossing


def spread(crossing: Potential, start: Cell, goal: Cell, *, use_astar: bool = False) -> Potential:
    """Return the potentials around `start`.

    The wave stops at `goal`, when no more cells can be reached, or after a limited number of batches.

    Args:
        crossing: costs by row and column. Cells of the border must have a cost that forbids crossing.
        start, goal: column and row of cells inside the border.
        use_astar: whether to prefer cells near the goal, by adding the cost of the straight line to the goal
            before comparing with the threshold. Fewer cells are visited, but in more batches.
    """
    height, width = crossing.shape
    cost = crossing.ravel()
    least = np.where(cost < _BLOCKED, cost * np.float32(_LEAST_GAIN), np.float32(_NEVER))
    field = np.full(cost.size, UNREACHED, np.float32)
    order = np.zeros(cost.size, np.int32)
    neighbours = np.array([[-1], [1], [-width], [width]])
    end, origin = goal[1] * width + goal[0], start[1] * width + start[0]
    threshold = _FIRST_THRESHOLD
    if use_astar:
        threshold += float(_to_goal(np.array([origin]), goal, width)[0])
    field[origin] = 0
    batch = (origin + neighbours).ravel()
    batch = batch[(batch >= 0) & (batch < cost.size)]
    batch = batch[cost[batch] < _BLOCKED]
    later: list[npt.NDArray[np.int64]] = []
    for _ in range(cost.size if use_astar else max(cost.size // 20, width + height)):
        batch = _improve(field, cost, batch, width)
        _improve(field, cost, batch, width)
        values = field[batch]
        reached = (batch + neighbours).ravel()
        values = np.concatenate((values, values, values, values))
        is_better = field[reached] > values + least[reached]
        reached, values = reached[is_better], values[is_better]
        if use_astar:
            values = values + _to_goal(reached, goal, width)
        is_near = values < threshold
        later.append(reached[~is_near])
        batch = _unique(reached[is_near], order)
        if not len(batch):
            batch = _unique(np.concatenate(later), order)
            later.clear()
            threshold += 2 * NEUTRAL
            if not len(batch):
                break
        if field[end] < UNREACHED:
            break
    return field.reshape(height, width)


def _improve(
    field: Potential, cost: Potential, cells: npt.NDArray[np.int64], width: int
) -> npt.NDArray[np.int64]:
    """Compute the potentials of cells. Return the cells whose potential has decreased."""
    in_x = np.minimum(field[cells - 1], field[cells + 1])
    in_y = np.minimum(field[cells - width], field[cells + width])
    crossing = cost[cells]
    ratio = np.abs(in_x - in_y) / crossing
    share = (np.float32(-0.2301) * ratio + np.float32(0.5307)) * ratio + np.float32(0.7040)
    share[ratio >= 1] = 1
    values = np.minimum(in_x, in_y) + crossing * share
    is_better = values < field[cells]
    field[cells[is_better]] = values[is_better]
    better: npt.NDArray[np.int64] = cells[is_better]
    return better


def _unique(cells: npt.NDArray[np.int64], order: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """Remove duplicate cells faster than by sorting. `order` is scratch memory, one number per map cell."""
    numbers = np.arange(len(cells), dtype=np.int32)
    order[cells] = numbers
    is_last: npt.NDArray[np.bool_] = order[cells] == numbers
    unique: npt.NDArray[np.int64] = cells[is_last]
    return unique


def _to_goal(cells: npt.NDArray[np.int64], goal: Cell, width: int) -> Potential:
    rows, columns = np.divmod(cells, width)
    return (np.hypot(columns - goal[0], rows - goal[1]) * NEUTRAL).astype(np.float32)
