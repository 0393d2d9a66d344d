"""The static layer: the costs of an existing map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipros_libraries.transforms.pose import Pose, rotation_matrix
from pipros_robot.navigation.costmap.grid import FREE, LETHAL, UNKNOWN, Costs
from pipros_robot.navigation.costmap.layered import Bounds, CellLayer, CellRectangle, LayeredCostmap, Pose2D


@dataclass(frozen=True, slots=True)
class StaticSettings:
    """The layer's parameters: the topic of the map, and the conversion of its cells to costs."""

    map_topic: str = "map"
    first_map_only: bool = False
    subscribe_to_updates: bool = False
    track_unknown_space: bool = True
    lethal_cost_threshold: int = 100
    unknown_cost_value: int = -1
    trinary_costmap: bool = True
    use_maximum: bool = False


class StaticLayer(CellLayer):
    """Costs of an occupancy grid.

    Unless the costmap is rolling, each map sets the size and position of the costmap.
    """

    def __init__(
        self,
        name: str,
        costmap: LayeredCostmap,
        settings: StaticSettings,
        find_map: Callable[[str], Pose | None] = lambda _: None,
    ) -> None:
        """Create a layer without a map.

        `find_map` returns the pose of a rolling costmap's frame in the map's frame, or None.
        """
        super().__init__(name, costmap, FREE)
        self.map_frame: str | None = None
        self._settings = settings
        self._find_map = find_map
        self._updated = CellRectangle(0, 0, 0, 0)
        threshold = min(max(settings.lethal_cost_threshold, 0), 100)
        values = np.arange(256)
        scaled = (values / max(threshold, 1) * LETHAL).astype(np.int64)
        below = 0 if settings.trinary_costmap else np.minimum(scaled, LETHAL)
        costs = np.where(values >= threshold, LETHAL, below)
        costs[settings.unknown_cost_value % 256] = UNKNOWN if settings.track_unknown_space else FREE
        self._table: Costs = costs.astype(np.uint8)

    def match_size(self) -> None:
        if not self.costmap.is_rolling:
            super().match_size()

    def reset(self) -> None:
        """Make the next update write the whole map."""
        self._updated = CellRectangle(0, 0, self.grid.width, self.grid.height)

    def set_map(self, message: Any) -> None:
        """Replace the map with a `nav_msgs/OccupancyGrid`.

        Raises:
            ValueError: the map's size, resolution or origin is invalid.
        """
        info = message.info
        geometry = (info.width, info.height, info.resolution, info.origin.position.x, info.origin.position.y)
        if not info.resolution > 0 or not np.isfinite(geometry).all():
            raise ValueError(f"a map's resolution must be > 0, and its origin finite, got {geometry[2:]}")
        if len(message.data) != info.width * info.height:
            raise ValueError(f"a map must have {info.width} X {info.height} cells, got {len(message.data)}")
        costmap = self.costmap
        if not costmap.is_rolling and (costmap.grid.geometry != geometry or not costmap.is_size_locked):
            costmap.resize(*geometry, lock=True)
        elif self.grid.geometry != geometry:
            self.grid.resize(*geometry)
        self.map_frame = message.header.frame_id
        self._write(message.data, CellRectangle(0, 0, info.width, info.height))

    def set_part(self, message: Any) -> None:
        """Apply a `map_msgs/OccupancyGridUpdate`.

        Raises:
            ValueError: the update is not inside the map, or does not have one value per cell.
        """
        part = CellRectangle(message.x, message.y, message.x + message.width, message.y + message.height)
        is_inside = part.x0 >= 0 <= part.y0 and part.xn <= self.grid.width and part.yn <= self.grid.height
        if not is_inside:
            size = f"the map of {self.grid.width} X {self.grid.height}"
            where = f"columns {part.x0} to {part.xn} and rows {part.y0} to {part.yn}"
            raise ValueError(f"an update must lie inside {size}, got {where}")
        if len(message.data) != message.width * message.height:
            size = f"{message.width} X {message.height}"
            raise ValueError(f"an update must have {size} values, got {len(message.data)}")
        self._write(message.data, part)

    def _write(self, data: Any, part: CellRectangle) -> None:
        values = np.array(data, np.int8).view(np.uint8)
        rows, columns = part.slices
        self.grid.costs[rows, columns] = self._table[values].reshape(part.yn - part.y0, part.xn - part.x0)
        self._updated = part.united(self._updated)

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:  # noqa: ARG002 # part of the interface
        if self.map_frame is None:
            return
        self.use_extra_bounds(bounds)
        part = self._updated
        if self.costmap.is_rolling:
            part = CellRectangle(0, 0, self.grid.width, self.grid.height)
        if part.x0 < part.xn:
            bounds.touch(*self.grid.cell_to_world(part.x0, part.y0))
            bounds.touch(*self.grid.cell_to_world(part.xn, part.yn))
        self._updated = CellRectangle(0, 0, 0, 0)

    def update_costs(self, window: CellRectangle) -> None:
        if self.map_frame is None:
            return
        if not self.costmap.is_rolling:
            by_maximum = self._settings.use_maximum
            self.write(window, by_maximum=by_maximum, with_unknown=not by_maximum)
        elif (pose := self._find_map(self.map_frame)) is not None:
            self._write_moved(window, pose)

    def _write_moved(self, window: CellRectangle, pose: Pose) -> None:
        """Set each cell to the map's cost at its centre. The map's frame may be rotated and translated."""
        grid = self.costmap.grid
        columns, rows = np.arange(window.x0, window.xn)[None, :], np.arange(window.y0, window.yn)[:, None]
        x, y = grid.cell_to_world(columns, rows)
        turn = rotation_matrix(pose)
        map_columns, map_rows, inside = self.grid.world_to_cells(
            turn[0] * x + turn[1] * y + pose[0], turn[3] * x + turn[4] * y + pose[1]
        )
        if not self.grid.costs.size:
            return
        found = self.grid.costs[map_rows, map_columns]
        part = grid.costs[window.slices]
        if self._settings.use_maximum:
            found = np.maximum(found, part)
        np.copyto(part, found, where=inside)
