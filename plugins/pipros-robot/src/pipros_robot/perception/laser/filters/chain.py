"""Filter chains, which are described by lists of maps with `name`, `type` and `params`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from pipros_robot.perception.laser.filters import angles, arrays, neighbors, shapes, thresholds
from pipros_robot.perception.laser.filters.base import FilterHost, InvalidFilter, ScanFilter
from pipros_robot.perception.laser.scan import Scan

TYPES: Final[Mapping[str, type[ScanFilter]]] = {
    "InterpolationFilter": thresholds.InterpolationFilter,
    "LaserArrayFilter": arrays.ArrayFilter,
    "LaserMedianFilter": arrays.MedianFilter,
    "LaserScanAngularBoundsFilter": angles.AngularBoundsFilter,
    "LaserScanAngularBoundsFilterInPlace": angles.AngularBoundsFilterInPlace,
    "LaserScanBoxFilter": shapes.BoxFilter,
    "LaserScanFootprintFilter": shapes.FootprintFilter,
    "LaserScanIntensityFilter": thresholds.IntensityFilter,
    "LaserScanMaskFilter": thresholds.MaskFilter,
    "LaserScanPolygonFilter": shapes.PolygonFilter,
    "LaserScanRangeFilter": thresholds.RangeFilter,
    "LaserScanSectorFilter": angles.SectorFilter,
    "LaserScanSpeckleFilter": neighbors.SpeckleFilter,
    "ScanBlobFilter": neighbors.BlobFilter,
    "ScanShadowsFilter": neighbors.ShadowsFilter,
    "StaticLaserScanPolygonFilter": shapes.StaticPolygonFilter,
}
"""Filter classes by type, without the prefix `laser_filters/`."""


class FilterChain:
    """Filters that are applied in sequence."""

    def __init__(self, filters: Sequence[ScanFilter]) -> None:
        self.filters = filters

    def update(self, scan: Scan) -> Scan:
        """Return the filtered scan.

        Raises:
            FilterFailed: a filter cannot process the scan.
        """
        for each in self.filters:
            scan = each.update(scan)
        return scan


def chain_of(description: Any, place: FilterHost, what: str = "scan_filter_chain") -> FilterChain:
    """Create a chain from its description. The chain is empty if the description is None.

    Args:
        what: the parameter's name, for error messages.

    Raises:
        InvalidFilter: the description is invalid.
    """
    if isinstance(description, dict) and "filter_chain" in description:
        description = description["filter_chain"]
    if description is None:
        description = []
    if not isinstance(description, list):
        raise InvalidFilter(f"~{what} must be a list of filters, got {description!r}")
    filters: list[ScanFilter] = []
    for index, entry in enumerate(description):
        spot = f"~{what}[{index}]"
        if not isinstance(entry, dict) or not all(
            isinstance(entry.get(key), str) for key in ("name", "type")
        ):
            raise InvalidFilter(f"{spot} must be a map with name and type, got {entry!r}")
        name, (package, _, kind) = entry["name"], entry["type"].partition("/")
        if package != "laser_filters" or kind not in TYPES:
            known = ", ".join(sorted(TYPES))
            raise InvalidFilter(
                f"{spot}: type must be laser_filters/ followed by one of {known}, got {entry['type']}"
            )
        if any(name == each.name for each in filters):
            raise InvalidFilter(f"{spot}: names must be unique, got {name} twice")
        params = entry.get("params", {})
        if not isinstance(params, dict):
            raise InvalidFilter(f"{spot}: params must be a map, got {params!r}")
        filters.append(TYPES[kind](name, params, place))
    return FilterChain(filters)
