"""The published map: visits and hits of cells along the trajectory of one particle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.costmap.grid import line_cells
from pipros_robot.navigation.mapping.hit_maps import Array, Cells, cells_of
from pipros_robot.navigation.mapping.settings import MappingSettings

GROWTH_M: Final = 10.0
"""How far the map grows beyond a scan that leaves it."""
_MULTIPLE: Final = 32
"""As in gmapping, the width and height are multiples of this number of cells."""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryStep:
    """A processed scan on a particle's trajectory. It follows the step `parent`."""

    pose: tuple[float, float, float]
    ranges: Array
    parent: TrajectoryStep | None


class Survey:
    """Counts, per cell, visits (beams that passed through or ended in it) and hits (beams that ended in it).

    Counts are sums over scans. To switch to another trajectory, only the scans that differ are removed and
    added. Not thread-safe.
    """

    def __init__(self, settings: MappingSettings, angles: Array, limit: int = 100_000_000) -> None:
        """Start with an empty map. It does not grow beyond `limit` cells; beams outside are cut off."""
        self._settings, self._angles, self._limit = settings, angles, limit
        delta = settings.delta
        height, width = (
            max(1, int(np.ceil((high - low) / delta - 1e-9)) // _MULTIPLE) * _MULTIPLE
            for low, high in ((settings.ymin, settings.ymax), (settings.xmin, settings.xmax))
        )
        self.origin = settings.xmin, settings.ymin
        self._visits = np.zeros((height, width), np.int32)
        self._hits = np.zeros((height, width), np.int32)
        self._last: TrajectoryStep | None = None

    def follow(self, last: TrajectoryStep | None) -> None:
        """Change the counts to match the trajectory that ends with the step `last`."""
        old, new = _path(self._last), _path(last)
        shared = set(map(id, old)) & set(map(id, new))
        for steps, sign in ((old, -1), (new, 1)):
            for step in steps:
                if id(step) not in shared:
                    self._add(step, sign)
        self._last = last

    def values(self) -> NDArray[np.int8]:
        """Return the map: -1 unknown, 0 free, 100 occupied; shape (rows, columns)."""
        values = np.full(self._visits.shape, -1, np.int8)
        rows, columns = self._visits.any(axis=1), self._visits.any(axis=0)
        if rows.any():
            low, left = int(rows.argmax()), int(columns.argmax())
            part = (
                slice(low, len(rows) - int(rows[::-1].argmax())),
                slice(left, len(columns) - int(columns[::-1].argmax())),
            )
            visits, hits = self._visits[part], self._hits[part]
            known = np.where(hits > self._settings.occ_thresh * visits, 100, 0)
            values[part] = np.where(visits > 0, known, -1)
        return values

    def _add(self, step: TrajectoryStep, sign: int) -> None:
        settings, (x, y, yaw) = self._settings, step.pose
        is_used = (step.ranges > 0.0) & (step.ranges <= settings.maxRange)  # False for NaN
        reach = np.minimum(step.ranges[is_used], settings.maxUrange)
        angles = self._angles[is_used] + yaw
        ends_x, ends_y = x + reach * np.cos(angles), y + reach * np.sin(angles)
        self._grow(min(x, *ends_x, x), min(y, *ends_y, y), max(x, *ends_x, x), max(y, *ends_y, y))
        (columns, column), (rows, row) = (
            (cells_of(ends - start, settings.delta), int(cells_of(np.array(place - start), settings.delta)))
            for ends, place, start in ((ends_x, x, self.origin[0]), (ends_y, y, self.origin[1]))
        )
        passed_columns, passed_rows = line_cells(column, row, columns, rows)
        self._count(self._visits, passed_rows, passed_columns, sign)
        is_end = reach < settings.maxUrange
        self._count(self._visits, rows[~is_end], columns[~is_end], -sign)  # a cut-off beam does not end here
        self._count(self._hits, rows[is_end], columns[is_end], sign)

    @staticmethod
    def _count(counts: NDArray[np.int32], rows: Cells, columns: Cells, sign: int) -> None:
        height, width = counts.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        np.add.at(counts.reshape(-1), rows[inside] * width + columns[inside], sign)

    def _grow(self, left: float, bottom: float, right: float, top: float) -> None:
        """Enlarge the map by multiples of `_MULTIPLE` cells if a scan leaves it."""
        (height, width), delta = self._visits.shape, self._settings.delta
        (x, y), far = self.origin, GROWTH_M
        low_x, low_y = (
            int(np.floor((end - far - start) / delta / _MULTIPLE)) if end < start else 0
            for end, start in ((left, x), (bottom, y))
        )
        high_x, high_y = (
            int(np.ceil((end + far - start) / delta / _MULTIPLE)) if end > start + delta * (count - 1)
            else count // _MULTIPLE
            for end, start, count in ((right, x, width), (top, y, height))
        )  # fmt: skip
        shape = (high_y - low_y) * _MULTIPLE, (high_x - low_x) * _MULTIPLE
        if shape == (height, width) or shape[0] * shape[1] > self._limit:
            return
        self.origin = x + low_x * _MULTIPLE * delta, y + low_y * _MULTIPLE * delta
        down, aside = -low_y * _MULTIPLE, -low_x * _MULTIPLE
        for name in ("_visits", "_hits"):
            grown = np.zeros(shape, np.int32)
            grown[down : down + height, aside : aside + width] = getattr(self, name)
            setattr(self, name, grown)


def _path(last: TrajectoryStep | None) -> list[TrajectoryStep]:
    steps: list[TrajectoryStep] = []
    while last is not None:
        steps.append(last)
        last = last.parent
    return steps
