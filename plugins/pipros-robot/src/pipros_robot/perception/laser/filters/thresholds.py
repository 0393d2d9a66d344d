"""Filters that process beams individually by range, intensity or index, or fill gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from pipros_libraries.reconfiguring.server import Setting
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import InvalidFilter, ScanFilter
from pipros_robot.perception.laser.scan import Scan

_FAR: Final = 100_000.0


class RangeFilter(ScanFilter):
    """Replaces ranges <= the lower threshold and ranges >= the upper threshold."""

    settings = (
        Setting("lower_threshold", 0.0, 0.0, _FAR),
        Setting("upper_threshold", _FAR, 0.0, _FAR),
        Setting("use_message_range_limits", False),
        Setting("lower_replacement_value", 0.0, 0.0, _FAR),
        Setting("upper_replacement_value", _FAR, 0.0, _FAR),
    )
    is_reconfigurable = True

    def update(self, scan: Scan) -> Scan:
        given = self.values
        low, high = given["lower_threshold"], given["upper_threshold"]
        if given["use_message_range_limits"]:
            low, high = scan.range_min, scan.range_max
        ranges = scan.ranges.astype(np.float64)
        with np.errstate(invalid="ignore"):
            is_low, is_high = ranges <= low, ranges >= high
        ranges[is_high] = given["upper_replacement_value"]
        ranges[is_low] = given["lower_replacement_value"]
        return scan.with_ranges(ranges)


class IntensityFilter(ScanFilter):
    """Selects beams whose intensities are outside two thresholds, or inside if `invert` is true.

    If `filter_override_range` is true, removes these beams. If `filter_override_intensity` is true, sets
    their intensities to 0 and all other intensities to 1.
    """

    settings = (
        Setting("lower_threshold", 8000.0, 0.0, _FAR),
        Setting("upper_threshold", _FAR, 0.0, _FAR),
        Setting("invert", False),
        Setting("filter_override_range", True),
        Setting("filter_override_intensity", False),
    )
    is_reconfigurable = True

    def update(self, scan: Scan) -> Scan:
        given = self.values
        strength = scan.intensities[: len(scan.ranges)]
        with np.errstate(invalid="ignore"):
            hit = (strength <= given["lower_threshold"]) | (strength >= given["upper_threshold"])
        hit = hit != given["invert"]
        filtered = scan.without(np.flatnonzero(hit)) if given["filter_override_range"] else scan
        if given["filter_override_intensity"]:
            intensities = scan.intensities.copy()
            intensities[: len(hit)] = np.where(hit, 0.0, 1.0)
            filtered = replace(filtered, intensities=intensities)
        return filtered


class MaskFilter(ScanFilter):
    """Removes the beams whose indices are listed in `masks` for the scan's frame."""

    def read(self, params: Mapping[str, Any]) -> None:
        masks = params.get("masks")
        if not isinstance(masks, dict) or not all(
            isinstance(mask, list) and all(type(each) is int for each in mask) for mask in masks.values()
        ):
            raise InvalidFilter(
                f"filter {self.name}: masks must map frames to lists of indices, got {masks!r}"
            )
        self._masks = masks

    def update(self, scan: Scan) -> Scan:
        beams = np.array(self._masks.get(scan.frame, []), np.int64)
        return scan.without(beams[(beams >= 0) & (beams < len(scan.ranges))])


class InterpolationFilter(ScanFilter):
    """Replaces each run of invalid ranges with the mean of the valid ranges on both sides.

    At the start of a scan, `range_max` - 0.01 is used as the missing range. At the end, the range after the
    previous run is used or, if there is no previous run, `range_max` - 0.01.
    """

    def update(self, scan: Scan) -> Scan:
        with np.errstate(invalid="ignore"):
            invalid = (scan.ranges <= scan.range_min) | (scan.ranges >= scan.range_max)
        ranges = scan.ranges.astype(np.float64)
        before = after = scan.range_max - 0.01
        edges = np.flatnonzero(np.diff(np.concatenate([[False], invalid, [False]])))
        last_end = 0
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            if start > last_end:
                before = float(scan.ranges[start - 1])
            if end < len(ranges):
                after = float(scan.ranges[end])
            ranges[start:end] = (before + after) / 2.0
            # As in the original, the next run is searched for after the beam at `end`.
            before, last_end = after, end + 1
        return scan.with_ranges(ranges)
