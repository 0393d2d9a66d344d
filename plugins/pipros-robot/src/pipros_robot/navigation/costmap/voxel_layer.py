"""The voxel layer: an obstacle layer that also records the heights of obstacles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from pipros_robot.navigation.costmap.grid import (
    FREE,
    LETHAL,
    UNKNOWN,
    CostGrid,
    Numbers,
    cells_on_lines,
    shortened,
)
from pipros_robot.navigation.costmap.layered import Bounds, Pose2D
from pipros_robot.navigation.costmap.observations import Observation
from pipros_robot.navigation.costmap.obstacle_layer import RAYS_AT_ONCE, ObstacleLayer, touch_rays

_VOXELS: Final = 16
_NOTHING_KNOWN: Final = 0xFFFF
_NUMBERS: Final = np.arange(1 << _VOXELS, dtype=np.uint16)
_BITS: Final = np.unpackbits(_NUMBERS.view(np.uint8)).reshape(-1, _VOXELS).sum(1, np.uint8)
_BELOW_TOP_M: Final = 0.01


class VoxelLayer(ObstacleLayer):
    """Costs of columns of up to 16 voxels, each of which is marked, free or unknown.

    Rays clear voxels up to two cells before their points. A column with more marked voxels than a threshold
    costs 254. Any other column that a ray passes is free, or unknown if too many of its voxels are unknown.

    Attributes:
        columns: a grid of bit masks. Bits 0 to 15 are set for unknown and marked voxels, bits 16 to 31 for
            marked voxels.
        origin_z, z_resolution, z_voxels: the lowest height, and the size and number of voxels.
        after_update: called after each update.
    """

    origin_z, z_resolution, z_voxels = 0.0, 0.2, 10
    after_update: Callable[[], object] = staticmethod(lambda: None)
    _most_marked, _most_unknown = 0, 15

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self.columns = CostGrid(_NOTHING_KNOWN, np.uint32)
        super().__init__(*arguments, **options)

    def configure(self, values: Mapping[str, Any]) -> None:
        """Apply the settings, and reset all voxels and costs."""
        self.origin_z, self.z_resolution = values["origin_z"], values["z_resolution"]
        self.z_voxels, self._most_marked = values["z_voxels"], values["mark_threshold"]
        self._most_unknown = values["unknown_threshold"] + _VOXELS - self.z_voxels
        self.match_size()

    def match_size(self) -> None:
        super().match_size()
        self.columns.resize(*self.grid.geometry)

    def reset(self) -> None:
        super().reset()
        self.columns.costs[...] = _NOTHING_KNOWN

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:
        if self.costmap.is_rolling:
            self.columns.center_on(robot.x, robot.y)
        super().update_bounds(robot, bounds)
        self.after_update()

    def _places(self, points: Numbers) -> tuple[Numbers, Numbers]:
        """Return positions in cells (not rounded), shape (n, 3), and a mask of positions inside the grid."""
        grid = self.grid
        low = np.array((grid.origin_x, grid.origin_y, self.origin_z))
        places: Numbers = (points - low) / (grid.resolution, grid.resolution, max(self.z_resolution, 1e-9))
        return places, ((places >= 0) & (places < (grid.width, grid.height, self.z_voxels))).all(axis=1)

    def _mark(self, seen: Observation, limit: float, bounds: Bounds) -> None:
        points = self._near(seen, limit)
        places, inside = self._places(
            np.column_stack((points[:, :2], np.maximum(points[:, 2], self.origin_z)))
        )
        column, row, height = places[inside].astype(np.int64).T
        columns, cells = self.columns.costs.reshape(-1), row * self.grid.width + column
        np.bitwise_or.at(columns, cells, (0x10001 << height).astype(np.uint32))
        is_marked = _BITS[columns[cells] >> _VOXELS] > self._most_marked
        self.grid.costs.reshape(-1)[cells[is_marked]] = LETHAL
        bounds.touch_all(points[inside, 0], points[inside, 1])

    def _clear(self, seen: Observation, limit: float, bounds: Bounds) -> None:
        origin = np.array(seen.origin)
        (start,), (is_inside,) = self._places(origin[None])
        if not is_inside:
            text = "the sensor at (%.2f, %.2f, %.2f) is outside the voxels and cannot clear them"
            self._warn(text, *seen.origin)
            return
        ends = self._shortened(origin, seen.points.astype(np.float64))
        places, inside = self._places(ends)
        places, reach = places[inside], self.grid.in_cells(limit)
        shares = np.minimum(1.0, reach / np.maximum(np.linalg.norm(places - start, axis=1), 1e-9))
        for first in range(0, len(places), RAYS_AT_ONCE):
            part = slice(first, first + RAYS_AT_ONCE)
            voxels = cells_on_lines(start.astype(np.int64), places[part].astype(np.int64), shares[part])
            self._free(*voxels.T)
        touch_rays(bounds, origin, ends[inside], limit)

    def _free(self, column: Numbers, row: Numbers, height: Numbers) -> None:
        columns, cells = self.columns.costs.reshape(-1), row * self.grid.width + column
        np.bitwise_and.at(columns, cells, ~(0x10001 << height).astype(np.uint32))
        passed = np.unique(cells)
        lower, marked = columns[passed] & 0xFFFF, columns[passed] >> _VOXELS
        is_free = _BITS[marked] <= self._most_marked
        is_known = _BITS[lower ^ marked] <= self._most_unknown
        costs = np.where(is_known, FREE, UNKNOWN)[is_free]
        self.grid.costs.reshape(-1)[passed[is_free]] = costs

    def _shortened(self, origin: Numbers, points: Numbers) -> Numbers:
        """Return the ends of rays: two cells before the points, clipped to the map and its heights."""
        grid, away = self.grid, points - origin
        lengths = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        ends: Numbers = np.maximum(0.0, (lengths - 2 * grid.resolution) / lengths)[:, None] * away + origin
        low = np.array((grid.origin_x, grid.origin_y, self.origin_z))
        size = (np.array((grid.width, grid.height)) - 0.5) * grid.resolution
        high = np.array((*(low[:2] + size), self.max_height))
        return shortened(origin, ends, low, high, (0.0, 0.0, _BELOW_TOP_M))
