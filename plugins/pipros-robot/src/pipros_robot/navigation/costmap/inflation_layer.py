"""The inflation layer: costs that decrease with the distance to the nearest obstacle."""

from __future__ import annotations

import cv2
import numpy as np

from pipros_robot.navigation.costmap.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, Costs, Numbers
from pipros_robot.navigation.costmap.layered import Bounds, CellRectangle, Layer, LayeredCostmap, Pose2D


class InflationLayer(Layer):
    """Raises costs around cells of cost 254, up to a radius.

    Let d be the distance in metres between the centres of a cell and of the nearest obstacle, r the inscribed
    radius of the footprint, and k the scaling factor. The cost is 253 for d <= r, otherwise
    252 exp(-k (d - r)), rounded down. The distances are exact (Felzenszwalb and Huttenlocher, "Distance
    Transforms of Sampled Functions", in OpenCV); costmap_2d finds the nearest obstacle by spreading a wave.
    """

    def __init__(self, name: str, costmap: LayeredCostmap) -> None:
        super().__init__(name, costmap)
        self._radius, self._scaling, self._inflates_unknown = 0.0, 0.0, False
        self._must_inflate_all = True
        self._last = Bounds()
        self.match_size()

    def configure(self, *, radius: float, scaling: float, inflate_unknown: bool) -> None:
        """Set the radius (m), the scaling factor (1/m), and whether to raise the costs of unknown cells."""
        self._radius, self._scaling, self._inflates_unknown = radius, scaling, inflate_unknown
        self.footprint_changed()

    def match_size(self) -> None:
        self._cells = self.costmap.grid.in_cells(self._radius)

    def footprint_changed(self) -> None:
        self.match_size()
        self._must_inflate_all = True

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:  # noqa: ARG002 # part of the interface
        now = Bounds()
        now.include(bounds)
        if self._must_inflate_all:
            limit = float(np.finfo(np.float32).max)
            bounds.touch(-limit, -limit)
            bounds.touch(limit, limit)
            self._must_inflate_all = False
        else:
            bounds.include(self._last)
            if bounds.min_x <= bounds.max_x:
                bounds.touch(bounds.min_x - self._radius, bounds.min_y - self._radius)
                bounds.touch(bounds.max_x + self._radius, bounds.max_y + self._radius)
        self._last = now

    def update_costs(self, window: CellRectangle) -> None:
        """Raise the costs around the obstacles in a part of the map and near it."""
        if not self._cells:
            return
        grid = self.costmap.grid
        sources = window.grown(self._cells, grid)
        reached = sources.grown(self._cells, grid)
        part = grid.costs[reached.slices]
        open_cells = np.ones(part.shape, np.uint8)
        inner = (
            slice(sources.y0 - reached.y0, sources.yn - reached.y0),
            slice(sources.x0 - reached.x0, sources.xn - reached.x0),
        )
        open_cells[inner] = part[inner] != LETHAL
        if open_cells.all():
            return
        distances = cv2.distanceTransform(open_cells, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        squares = np.rint(distances * distances).astype(np.int64)
        farthest = min(int(squares.max()), self._cells**2)
        if farthest < squares.size:  # few distances occur, again and again
            costs = self._costs_at(np.arange(farthest + 2)).take(squares, mode="clip")
        else:
            costs = self._costs_at(squares)
        least = FREE + 1 if self._inflates_unknown else INSCRIBED
        np.copyto(part, costs, where=np.where(part == UNKNOWN, costs >= least, costs > part))

    def _costs_at(self, squares: Numbers) -> Costs:
        """Return the costs at squared distances in cells."""
        metres = np.sqrt(squares) * self.costmap.grid.resolution
        inscribed = self.costmap.inscribed_radius
        far = (INSCRIBED - 1) * np.exp(-self._scaling * np.maximum(metres - inscribed, 0.0))
        costs: Costs = np.where(metres <= inscribed, INSCRIBED, far).astype(np.uint8)
        return costs * ((squares > 0) & (squares <= self._cells**2))
