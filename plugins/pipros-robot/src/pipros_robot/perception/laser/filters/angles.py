"""Filters that keep or clear beams by angle."""

from __future__ import annotations

import math
from dataclasses import replace

from pipros_libraries.reconfiguring.server import Setting
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import ScanFilter
from pipros_robot.perception.laser.scan import Scan

_BOUNDS = (Setting("lower_angle", 0.0), Setting("upper_angle", 0.0))


class AngularBoundsFilter(ScanFilter):
    """Crops the scan to the beams from `lower_angle` to `upper_angle`."""

    settings = _BOUNDS
    required = ("lower_angle", "upper_angle")

    def update(self, scan: Scan) -> Scan:
        low, high = self.values["lower_angle"], self.values["upper_angle"]
        angles, step = scan.summed_angles(), scan.angle_increment
        if step < 0:
            before, beyond = angles > high, angles + step < low
        else:
            before, beyond = angles < low, angles + step > high
        start = int(np.argmin(before)) if not before.all() else len(angles)
        after = np.flatnonzero(beyond[start:])
        end = start + int(after[0]) + 1 if len(after) else len(angles)
        first = float(angles[start]) if start < len(angles) else scan.angle_min + step * start
        return replace(
            scan,
            stamp_ns=scan.stamp_of_cut(start),
            angle_min=first,
            angle_max=float(angles[end - 1]) + (0.0 if len(after) else step) if end > start else first,
            ranges=scan.ranges[start:end],
            intensities=scan.intensities[start:end],
        )


class AngularBoundsFilterInPlace(ScanFilter):
    """Clears the beams between `lower_angle` and `upper_angle`."""

    settings = _BOUNDS
    required = ("lower_angle", "upper_angle")

    def update(self, scan: Scan) -> Scan:
        angles = scan.summed_angles()
        return scan.cleared((angles > self.values["lower_angle"]) & (angles < self.values["upper_angle"]))


class SectorFilter(ScanFilter):
    """Clears the beams inside or outside a sector, which is defined by limits of angles and ranges."""

    settings = (
        Setting("angle_min", 0.0, -math.pi, math.pi),
        Setting("angle_max", 0.0, -math.pi, math.pi),
        Setting("range_min", 0.0, 0.0, 100_000.0),
        Setting("range_max", 100_000.0, 0.0, 100_000.0),
        Setting("clear_inside", True),
        Setting("invert", False),
    )
    is_reconfigurable = True

    def update(self, scan: Scan) -> Scan:
        given, angles = self.values, scan.summed_angles()
        low, high = given["angle_min"], given["angle_max"]
        inside = (angles > low) & (angles < high) if low <= high else (angles > low) | (angles < high)
        with np.errstate(invalid="ignore"):
            inside &= (scan.ranges > given["range_min"]) & (scan.ranges < given["range_max"])
        return scan.cleared(inside if given["clear_inside"] and not given["invert"] else ~inside)
