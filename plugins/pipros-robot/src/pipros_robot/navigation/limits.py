"""The limits of navigation."""

from typing import NamedTuple


class NavigationLimits(NamedTuple):
    """The limits of navigation. Get them with `limits.of(NavigationLimits)`, where `limits` is a `Limits`.

    Attributes:
        costmap_cells: maximum number of cells in a costmap, and in the map of each layer.
    """

    costmap_cells: int = 100_000_000
