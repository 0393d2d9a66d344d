"""The maps of all particles: the cells that beams hit, and the mean end points in these cells.

Theory of operation. Particles that descend from the same particle share most of their maps. Therefore, a map
is a table of blocks of 32 x 32 cells, and all maps take their blocks from one pool. Resampling copies only
the tables. A block that several particles share is copied when one of them writes to it. Block 0 is empty.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Cells = NDArray[np.int64]

SIDE: Final = 32
_AREA: Final = SIDE * SIDE
FURTHEST_BLOCKS: Final = 512
"""Ends of beams farther than this from the first block of the maps along an axis are ignored."""


def cells_of(positions: Array, delta: float) -> Cells:
    """Return the cells of positions in metres. As in gmapping, cell 0 is centred on 0."""
    found: Cells = np.floor(positions / delta + 0.5).astype(np.int64)
    return found


@dataclass(frozen=True, slots=True)
class DenseWindow:
    """A part of the maps of some particles, as dense arrays of shape (particles, rows, columns).

    Attributes:
        is_hit: whether beams ended in the cell.
        x, y: the mean of the ends in metres, if there are any.
        row, column: the first row and column in the map.
    """

    is_hit: NDArray[np.bool_]
    x: Array
    y: Array
    row: int
    column: int


class HitMaps:
    """The maps of a number of particles, on grids with the same origin."""

    def __init__(self, particles: int, delta: float) -> None:
        self._delta = delta
        self._table = np.zeros((particles, 1, 1), np.int64)
        self._row = self._column = 0  # block of the table's first row and column
        self._pools: list[Any] = [np.zeros((64, _AREA), kind) for kind in (np.int32, float, float)]

    def resample(self, chosen: Cells) -> None:
        """Replace the particles with copies of the chosen particles."""
        self._table = self._table[chosen]

    def add(self, x: Array, y: Array) -> None:
        """Add the ends of beams to each map; shape (particles, beams), in metres."""
        particles = np.repeat(np.arange(len(x)), x.shape[1])
        x, y = x.ravel(), y.ravel()
        columns, rows = cells_of(x, self._delta), cells_of(y, self._delta)
        far = np.maximum(abs(rows // SIDE - self._row), abs(columns // SIDE - self._column))
        near = far < FURTHEST_BLOCKS
        particles, rows, columns, x, y = particles[near], rows[near], columns[near], x[near], y[near]
        if not x.size:
            return
        self._cover(rows // SIDE, columns // SIDE)
        places = rows // SIDE - self._row, columns // SIDE - self._column
        height, width = self._table.shape[1:]
        self._make_own(np.unique((particles * height + places[0]) * width + places[1]))
        block = self._table[particles, places[0], places[1]]
        flat = block * _AREA + (rows % SIDE) * SIDE + columns % SIDE
        cells, member, counts = np.unique(flat, return_inverse=True, return_counts=True)
        hits, *pools = (pool.ravel() for pool in self._pools)
        before = hits[cells]
        hits[cells] += counts.astype(np.int32)
        for means, values in zip(pools, (x, y), strict=True):
            means[cells] = (means[cells] * before + np.bincount(member.ravel(), values)) / hits[cells]

    def _cover(self, rows: Cells, columns: Cells) -> None:
        """Enlarge the tables to include blocks."""
        height, width = self._table.shape[1:]
        below, left = max(0, self._row - int(rows.min())), max(0, self._column - int(columns.min()))
        above = max(0, int(rows.max()) + 1 - self._row - height)
        right = max(0, int(columns.max()) + 1 - self._column - width)
        if below or left or above or right:
            self._table = np.pad(self._table, ((0, 0), (below, above), (left, right)))
            self._row, self._column = self._row - below, self._column - left

    def _make_own(self, codes: Cells) -> None:
        """Give table entries (flat indices) their own blocks, which are not shared with other particles."""
        table = self._table.reshape(-1)
        users = np.bincount(table, minlength=len(self._pools[0]))
        codes = codes[(table[codes] == 0) | (users[table[codes]] > 1)]
        free = np.flatnonzero(users == 0)
        free = free[free > 0]
        lacking = len(codes) - len(free)
        if lacking > 0:
            more = np.arange(len(users), len(users) + max(lacking, len(users)))
            free = np.concatenate((free, more))
            self._pools = [np.pad(pool, ((0, len(more)), (0, 0))) for pool in self._pools]
        new, old = free[: len(codes)], table[codes]
        for pool in self._pools:
            pool[new] = pool[old]
        table[codes] = new
        self._table = table.reshape(self._table.shape)

    def window(self, particles: Cells, low: Array, high: Array) -> DenseWindow:
        """Return the part of some particles' maps between two corners (x, y in metres).

        The part is clipped to the maps plus a border of empty blocks.
        """
        first, last = (cells_of(np.asarray(corner), self._delta) // SIDE for corner in (low, high))
        table = np.pad(self._table[particles], ((0, 0), (1, 1), (1, 1)))
        row, column = self._row - 1, self._column - 1
        (left, right), (bottom, top) = (
            (max(int(first[axis]) - start, 0), max(int(last[axis]) - start + 1, 1))
            for axis, start in ((0, column), (1, row))
        )
        blocks = table[:, min(bottom, table.shape[1] - 1) : top, min(left, table.shape[2] - 1) : right]
        count, tall, wide = blocks.shape

        parts = (pool[blocks].reshape(count, tall, wide, SIDE, SIDE) for pool in self._pools)
        hits, x, y = (each.swapaxes(2, 3).reshape(count, tall * SIDE, wide * SIDE) for each in parts)
        row, column = row + min(bottom, table.shape[1] - 1), column + min(left, table.shape[2] - 1)
        return DenseWindow(hits > 0, x, y, row * SIDE, column * SIDE)
