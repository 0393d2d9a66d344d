"""Filters that compare each beam with its neighbours: shadows, speckles and blobs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pipros_libraries.reconfiguring.server import Setting
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import FilterFailed, ScanFilter
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array


def _shifted(values: Array, by: int) -> Array:
    """Shift values so that each beam gets the value of the beam `by` indices later, or NaN."""
    found = np.full(len(values), np.nan, values.dtype)
    if abs(by) < len(values):
        found[max(-by, 0) : len(values) - max(by, 0)] = values[max(by, 0) : len(values) + min(by, 0)]
    return found


class ShadowsFilter(ScanFilter):
    """Removes shadow points: spurious points between the edge of an object and its background.

    The line from a beam's point to the point of each beam within `window` beams forms an angle with the first
    beam. If the angle is less than `min_angle` or greater than `max_angle` (degrees), all more distant points
    within `neighbors` beams of the first beam are removed. If `remove_shadow_start_point` is true, the first
    beam's point is removed, too.
    """

    settings = (
        Setting("min_angle", 10.0, 0.0, 360.0),
        Setting("max_angle", 170.0, 0.0, 360.0),
        Setting("neighbors", 20, 0, 100),
        Setting("window", 1, 0, 100),
        Setting("remove_shadow_start_point", False),
    )
    required = ("min_angle", "max_angle", "window")
    is_reconfigurable = True

    def read(self, params: Mapping[str, Any]) -> None:
        given = dict(self.values)
        if type(params.get("neighbors")) is not int:
            given["neighbors"] = 0
        given["min_angle"] = min(max(given["min_angle"], 0.0), 90.0)
        given["max_angle"] = min(max(given["max_angle"], 90.0), 180.0)
        self.values = given

    def update(self, scan: Scan) -> Scan:
        given, ranges = self.values, scan.ranges
        steepest = abs(np.tan(np.float32(np.radians(given["min_angle"]))))
        flattest = -abs(np.tan(np.float32(np.radians(given["max_angle"]))))
        is_start = np.zeros(len(ranges), bool)
        window, around = (min(given[name], len(ranges)) for name in ("window", "neighbors"))
        with np.errstate(all="ignore"):
            for by in range(-window, window + 1):
                if by == 0:
                    continue
                other, angle = _shifted(ranges, by), np.float32(by) * np.float32(scan.angle_increment)
                across = (other * np.sin(np.float64(angle))).astype(np.float32)
                along = (ranges - other * np.cos(np.float64(angle))).astype(np.float32)
                tangent = np.abs(across) / along
                is_start |= ((tangent > 0) & (tangent < steepest)) | (~(tangent > 0) & (tangent > flattest))
            removed = is_start & given["remove_shadow_start_point"]
            starts = np.where(is_start, ranges, np.nan)
            for by in range(-around, around + 1):
                removed |= _shifted(starts, by) < ranges
        return scan.without(removed)


class SpeckleFilter(ScanFilter):
    """Removes isolated points that are not farther than `max_range`.

    Neighbouring beams are compared by range if `filter_type` is 0, or by distance between points if it is 1.
    """

    settings = (
        Setting("filter_type", 0, 0, 1),
        Setting("max_range", 2.0, 0.0, 100.0),
        Setting("max_range_difference", 0.4, 0.0, 100.0),
        Setting("filter_window", 4, 0, 100),
    )
    from_server = ("filter_type",)
    is_reconfigurable = True

    def update(self, scan: Scan) -> Scan:
        window, count = self.values["filter_window"], len(scan.ranges)
        if count <= window + 1:
            raise FilterFailed(
                f"filter {self.name}: a scan must have more than {window + 1} beams, got {count}"
            )
        with np.errstate(invalid="ignore"):
            kept = scan.ranges > self.values["max_range"]
        good = self._has_close_neighbors(scan) if self.values["filter_type"] else self._is_even(scan)
        for by in range(window):
            kept[by : count - window + 1 + by] |= good[: count - window + 1]
        return scan.without(~kept if window else slice(None))

    def _is_even(self, scan: Scan) -> Array:
        ranges, window = scan.ranges, self.values["filter_window"]
        even = ~np.isnan(ranges)
        with np.errstate(invalid="ignore"):
            for by in range(1, window):
                steps = np.abs(_shifted(ranges, by) - ranges) <= self.values["max_range_difference"]
                steps[len(ranges) - by :] = True
                even &= steps
        return even

    def _has_close_neighbors(self, scan: Scan) -> Array:
        ranges, window = scan.ranges, self.values["filter_window"]
        found, wide = np.zeros(len(ranges), int), ranges.astype(np.float64)
        with np.errstate(all="ignore"):
            for by in range(-window, window + 1):
                if by == 0:
                    continue
                other = _shifted(ranges, by)
                cosine = np.cos(np.float32(by) * np.float32(scan.angle_increment))
                product = np.float32(2) * ranges * other * cosine
                distance = np.sqrt(wide**2 + other.astype(np.float64) ** 2 - product).astype(np.float32)
                found += distance <= self.values["max_range_difference"]
        close: Array = found >= window
        return close


class BlobFilter(ScanFilter):
    """Keeps the middle beam of each small blob of more than `min_points` beams.

    All other ranges become negative.
    """

    settings = (Setting("max_radius", 0.1), Setting("min_points", 5))
    required = ("max_radius", "min_points")

    def update(self, scan: Scan) -> Scan:
        ranges = scan.ranges.astype(np.float64)
        filtered = -np.abs(scan.ranges)
        with np.errstate(invalid="ignore"):
            edges = np.flatnonzero(np.diff(np.concatenate([[False], scan.ranges >= 0, [False]])))
            for start, end in zip(edges[::2], edges[1::2], strict=True):
                if end - start <= self.values["min_points"]:
                    continue
                blob = np.stack([ranges[start:end], ranges[start:end] * scan.angle_increment])
                radius = np.abs(blob - blob.mean(1, keepdims=True)).max()
                if radius < self.values["max_radius"]:
                    middle = start + (end - start) // 2
                    filtered[middle] = np.abs(scan.ranges[middle])
        return scan.with_ranges(filtered)
