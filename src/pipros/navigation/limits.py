"""The limits of navigation."""

from typing import NamedTuple


class NavigationLimits(NamedTuple):
    """The limits of navigation: `limits.of(NavigationLimits)` for a `Limits`.

    Attributes:
        costmap_cells: cells of a costmap, and of the map in one of its layers.
        costmap_points: points of one observation source that a costmap keeps, and as many that wait for
            their transforms.
        mapped_cells: cells to which the map of slam_gmapping grows.
    """

    costmap_cells: int = 100_000_000
    costmap_points: int = 2_000_000
    mapped_cells: int = 100_000_000
