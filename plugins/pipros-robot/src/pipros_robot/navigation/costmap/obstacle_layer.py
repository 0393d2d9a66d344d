"""The obstacle layer, which marks points measured by sensors, and clears the space in front of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipros_robot.navigation.costmap.footprint import placed
from pipros_robot.navigation.costmap.grid import FREE, LETHAL, UNKNOWN, Numbers, Points, line_cells, shortened
from pipros_robot.navigation.costmap.layered import Bounds, CellLayer, CellRectangle, LayeredCostmap, Pose2D
from pipros_robot.navigation.costmap.observations import Observation, ObservationSource, squared_distances

OVERWRITE, MAXIMUM = 0, 1
RAYS_AT_ONCE = 4096
_INSIDE_M = 0.001


class ObstacleLayer(CellLayer):
    """Costs derived from the sensors' observations.

    Each update sets the cells on the rays of clearing sources to 0, then the cells with points of marking
    sources to 254, then, if `clears_footprint` is true, the cells under the robot to 0.

    Attributes:
        sources: the sensors, in the order of the parameter `observation_sources`.
        combination: 0 overwrites earlier layers, 1 takes the maximum, and any other value writes nothing.
    """

    def __init__(
        self,
        name: str,
        costmap: LayeredCostmap,
        now_ns: Callable[[], int],
        *,
        tracks_unknown: bool,
        warn: Callable[..., object] = lambda *_: None,
    ) -> None:
        super().__init__(name, costmap, UNKNOWN if tracks_unknown else FREE)
        self.sources: list[ObservationSource] = []
        self.combination = MAXIMUM
        self.max_height = 2.0
        self.clears_footprint = True
        self.before_update: Callable[[], None] = lambda: None
        self._now_ns = now_ns
        self._warn = warn
        self._footprint: Points = []
        self.match_size()

    def reset(self) -> None:
        self.grid.costs[...] = self.grid.default
        for source in self.sources:
            source.clear()
            source.touch(self._now_ns())
        self.is_current = True

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:
        if self.costmap.is_rolling:
            self.grid.center_on(robot.x, robot.y)
        self.use_extra_bounds(bounds)
        self.before_update()
        now_ns = self._now_ns()
        seen = [(source.settings, source.observations()) for source in self.sources]
        self.is_current = all(source.is_current(now_ns) for source in self.sources)
        for settings, observations in seen:
            for each in observations if settings.clearing else ():
                self._clear(each, settings.raytrace_range, bounds)
        for settings, observations in seen:
            for each in observations if settings.marking else ():
                self._mark(each, settings.obstacle_range, bounds)
        self._footprint = placed(self.costmap.footprint, *robot)
        if self.clears_footprint:
            for x, y in self._footprint:
                bounds.touch(x, y)

    def update_costs(self, window: CellRectangle) -> None:
        if self.clears_footprint:
            self.grid.fill_polygon(self._footprint, FREE)
        if self.combination in (OVERWRITE, MAXIMUM):
            self.write(window, by_maximum=self.combination == MAXIMUM)

    def _near(self, seen: Observation, limit: float) -> Numbers:
        """Return the points for marking, which are neither too high nor too far away."""
        points = seen.points[seen.points[:, 2] <= self.max_height]
        near: Numbers = points[squared_distances(points, seen.origin) < limit * limit].astype(np.float64)
        return near

    def _mark(self, seen: Observation, limit: float, bounds: Bounds) -> None:
        points = self._near(seen, limit)
        columns, rows, inside = self.grid.world_to_cells(points[:, 0], points[:, 1])
        self.grid.costs[rows[inside], columns[inside]] = LETHAL
        bounds.touch_all(points[inside, 0], points[inside, 1])

    def _clear(self, seen: Observation, limit: float, bounds: Bounds) -> None:
        grid = self.grid
        x, y = seen.origin[:2]
        start = grid.world_to_cell(x, y)
        if start is None:
            text = "the sensor at (%.2f, %.2f) is outside the costmap and cannot clear cells"
            self._warn(text, x, y)
            return
        low, origin = np.array((grid.origin_x, grid.origin_y)), np.array((x, y))
        high = low + np.array((grid.width, grid.height)) * grid.resolution
        ends = shortened(origin, seen.points[:, :2].astype(np.float64), low, high, _INSIDE_M)
        columns, rows, inside = grid.world_to_cells(*ends.T)
        cells = np.unique(rows[inside] * grid.width + columns[inside])
        for first in range(0, len(cells), RAYS_AT_ONCE):
            to_y, to_x = np.divmod(cells[first : first + RAYS_AT_ONCE], grid.width)
            ray_x, ray_y = line_cells(*start, to_x, to_y, grid.in_cells(limit))
            grid.costs[ray_y, ray_x] = FREE
        touch_rays(bounds, origin, ends[inside], limit)


def touch_rays(bounds: Bounds, origin: Numbers, ends: Numbers, limit: float) -> None:
    """Extend the bounds to include the first `limit` metres of rays, measured in the plane."""
    away = ends[:, :2] - origin[:2]
    shares = np.minimum(1.0, limit / np.maximum(np.hypot(*away.T), 1e-9))
    bounds.touch(*origin[:2])
    bounds.touch_all(*(origin[:2] + away * shares[:, None]).T)
