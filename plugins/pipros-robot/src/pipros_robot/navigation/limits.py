"""The limits of navigation."""

from typing import NamedTuple


class NavigationLimits(NamedTuple):
    """The limits of navigation. Get them with `limits.of(NavigationLimits)`, where `limits` is a `Limits`.

    Attributes:
        costmap_cells: maximum number of cells in a costmap, and in the map of each layer.
        costmap_points: maximum number of points that a costmap stores for each observation source. The same
            number of points may wait for their transforms.
        mapped_cells: maximum number of cells in the map of slam_gmapping or hector_mapping.
    """

    costmap_cells: int = 100_000_000
    costmap_points: int = 2_000_000
    mapped_cells: int = 100_000_000
