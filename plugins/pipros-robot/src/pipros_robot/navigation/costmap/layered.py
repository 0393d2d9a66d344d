"""A costmap made of layers. Each layer extends the area to recompute, then writes its costs into it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pipros_robot.navigation.costmap.footprint import inscribed_radius
from pipros_robot.navigation.costmap.grid import FREE, UNKNOWN, CostGrid, Costs, Numbers, Points

__all__ = ["CellRectangle", "Layer"]  # for layers of other distributions


class Pose2D(NamedTuple):
    """A pose in the plane: metres and radians."""

    x: float
    y: float
    yaw: float


class CellRectangle(NamedTuple):
    """A rectangle of cells: the first column and row, and the column and row after the last."""

    x0: int
    y0: int
    xn: int
    yn: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Slices of the rectangle's rows and columns."""
        return slice(self.y0, self.yn), slice(self.x0, self.xn)

    def united(self, other: CellRectangle) -> CellRectangle:
        """Return the smallest rectangle that contains both. An empty rectangle adds nothing."""
        if self.x0 >= self.xn or other.x0 >= other.xn:
            return other if self.x0 >= self.xn else self
        low = min(self.x0, other.x0), min(self.y0, other.y0)
        return CellRectangle(*low, max(self.xn, other.xn), max(self.yn, other.yn))

    def grown(self, cells: int, grid: CostGrid) -> CellRectangle:
        """Return the rectangle extended by `cells` on each side, and clipped to the grid."""
        low = max(0, self.x0 - cells), max(0, self.y0 - cells)
        return CellRectangle(*low, min(grid.width, self.xn + cells), min(grid.height, self.yn + cells))


class Bounds:
    """A growing rectangle, in metres."""

    def __init__(self) -> None:
        self.min_x = self.min_y = math.inf
        self.max_x = self.max_y = -math.inf

    def touch(self, x: float, y: float) -> None:
        """Grow to include a position."""
        self.min_x, self.max_x = min(self.min_x, x), max(self.max_x, x)
        self.min_y, self.max_y = min(self.min_y, y), max(self.max_y, y)

    def touch_all(self, x: Numbers, y: Numbers) -> None:
        """Grow to include positions."""
        if len(x):
            self.touch(float(x.min()), float(y.min()))
            self.touch(float(x.max()), float(y.max()))

    def include(self, other: Bounds) -> None:
        """Grow to include another rectangle, if it is not empty."""
        if other.min_x <= other.max_x:
            self.touch(other.min_x, other.min_y)
            self.touch(other.max_x, other.max_y)


class Layer:
    """Base class of costmap layers.

    Attributes:
        is_current: whether the data is recent enough for driving.
    """

    def __init__(self, name: str, costmap: LayeredCostmap) -> None:
        self.name, self.costmap = name, costmap
        self.is_enabled = self.is_current = True

    def match_size(self) -> None:
        """Adopt the size and position of the costmap."""

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:
        """Extend the bounds to include the area that must be recomputed."""

    def update_costs(self, window: CellRectangle) -> None:
        """Write the layer's costs into a part of the costmap's grid."""

    def footprint_changed(self) -> None:
        """Handle a change of the footprint."""

    def reset(self) -> None:
        """Discard all measurements."""


class LayeredCostmap:
    """The combined costs of several layers.

    Attributes:
        grid: the combined costs.
        is_rolling: whether the grid moves with the robot.
        is_size_locked: whether a layer has set the size, so that parameters no longer affect it.
        footprint: the padded outline of the robot, around its centre.
        inscribed_radius: inscribed radius of the footprint, in metres.
        window: the cells that the last update computed; None before the first update.
    """

    def __init__(self, *, is_rolling: bool = False, tracks_unknown: bool = False) -> None:
        self.grid = CostGrid(UNKNOWN if tracks_unknown else FREE)
        self.is_rolling = is_rolling
        self.tracks_unknown = tracks_unknown
        self.is_size_locked = False
        self.layers: list[Layer] = []
        self.footprint: Points = []
        self.inscribed_radius = inscribed_radius([])
        self.window: CellRectangle | None = None

    def resize(self, *geometry: Any, lock: bool = False) -> None:
        """Resize the costmap and all layers. Takes the arguments of `CostGrid.resize`."""
        self.is_size_locked |= lock
        self.grid.resize(*geometry)
        for layer in self.layers:
            layer.match_size()

    def set_footprint(self, padded: Points) -> None:
        """Set the outline of the robot."""
        self.footprint = padded
        self.inscribed_radius = inscribed_radius(padded)
        for layer in self.layers:
            layer.footprint_changed()

    @property
    def is_current(self) -> bool:
        """Whether the data of all enabled layers is recent enough for driving."""
        return all(layer.is_current for layer in self.layers if layer.is_enabled)

    def update(self, robot: Pose2D) -> None:
        """Recompute the costs where they may have changed."""
        grid = self.grid
        if self.is_rolling:
            grid.center_on(robot.x, robot.y)
        layers = [layer for layer in self.layers if layer.is_enabled]
        bounds = Bounds()
        for layer in layers:
            layer.update_bounds(robot, bounds)
        self.window = CellRectangle(0, 0, 0, 0)
        if not layers or not grid.costs.size or bounds.min_x > bounds.max_x:
            return
        x0, y0 = grid.nearest_cell(bounds.min_x, bounds.min_y)
        xn, yn = grid.nearest_cell(bounds.max_x, bounds.max_y)
        self.window = CellRectangle(x0, y0, xn + 1, yn + 1)
        grid.costs[self.window.slices] = grid.default
        for layer in layers:
            layer.update_costs(self.window)


class CellLayer(Layer):
    """A layer with its own grid. Base class of the static and the obstacle layer."""

    def __init__(self, name: str, costmap: LayeredCostmap, default: int) -> None:
        super().__init__(name, costmap)
        self.grid = CostGrid(default)
        self._extra = Bounds()

    def match_size(self) -> None:
        self.grid.resize(*self.costmap.grid.geometry)

    def clear_area(self, x0: int, y0: int, xn: int, yn: int, *, inside: bool = False) -> None:
        """Set the cells outside a rectangle or, if `inside` is true, in a rectangle to unknown.

        The next update recomputes the whole map.
        """
        costs = self.grid.costs
        chosen = np.zeros(costs.shape, bool)
        chosen[max(0, y0) : max(0, yn), max(0, x0) : max(0, xn)] = True
        costs[chosen if inside else ~chosen] = UNKNOWN
        self._extra.touch(self.grid.origin_x, self.grid.origin_y)
        self._extra.touch(*self.grid.cell_to_world(self.grid.width, self.grid.height))

    def use_extra_bounds(self, bounds: Bounds) -> None:
        """Extend the bounds to include areas that were cleared."""
        bounds.include(self._extra)
        self._extra = Bounds()

    def write(self, window: CellRectangle, *, by_maximum: bool, with_unknown: bool = False) -> None:
        """Write the layer's costs into the combined grid; unknown cells only if `with_unknown` is true."""
        mine = self.grid.costs[window.slices]
        combined: Costs = self.costmap.grid.costs[window.slices]
        if with_unknown:
            combined[...] = mine
            return
        chosen = mine != UNKNOWN
        if by_maximum:
            chosen &= combined + np.uint8(1) <= mine  # unknown + 1 wraps around to 0
        np.copyto(combined, mine, where=chosen)
