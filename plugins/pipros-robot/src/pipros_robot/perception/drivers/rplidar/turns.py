"""Assemble points into scans of full turns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from pipros_robot.perception.drivers.rplidar.samples import Point, Segment

MAX_POINTS: Final = 8192
"""Maximum number of points in a turn. A longer turn is dropped: the head has probably stopped turning."""


class TurnCollector:
    """Collects the points of each turn."""

    def __init__(self) -> None:
        self._points: list[Point] | None = None

    def add(self, segment: Segment) -> list[Point] | None:
        """Add a segment. Return the points of the turn that it completes, or None."""
        is_start, points = segment
        done = None
        if is_start:
            done, self._points = self._points, []
        if self._points is not None:
            self._points += points
            if len(self._points) > MAX_POINTS:
                self._points = None
        return done


@dataclass(frozen=True, slots=True)
class Sweep:
    """The measurements of a scan in the order of a LaserScan. Angles are in radians.

    Attributes:
        ranges: distances in metres; infinite if nothing was measured.
    """

    angle_min: float
    angle_max: float
    ranges: list[float]
    intensities: list[float]


def sweep_of(turn: Sequence[Point], cells_per_degree: float | None, *, is_inverted: bool) -> Sweep:
    """Convert the points of a turn to a scan.

    Args:
        cells_per_degree: if given, the points are assigned to equal cells that cover the full circle, and
            each point is repeated up to the next point, for about one degree at most. Otherwise, the scan
            begins with the first and ends with the last valid point.
        is_inverted: whether to keep the device's clockwise order.
    """
    valid = [at for at, point in enumerate(turn) if point.distance_mm]
    low, high = 0.0, 360.0
    if not valid:
        cells: list[tuple[float, float]] = [(0.0, 0.0)] * len(turn)
        high = 359.0
    elif cells_per_degree is not None:
        cells = _in_cells([turn[at] for at in valid], cells_per_degree)
    else:
        points = _sorted(turn, valid[0])
        kept = [at for at, point in enumerate(points) if point.distance_mm]
        points = points[kept[0] : kept[-1] + 1]
        low, high = points[0].angle, points[-1].angle
        cells = [(point.distance_mm, point.quality) for point in points]
    if not is_inverted:
        cells.reverse()  # the device's angles increase clockwise
    return Sweep(
        math.pi - math.radians(high),
        math.pi - math.radians(low),
        [distance_mm / 1000 if distance_mm else math.inf for distance_mm, _ in cells],
        [float(quality) for _, quality in cells],
    )


def cells_per_degree(sample_us: float, scan_hz: float) -> float:
    """Return the number of cells per degree, which is greater than the mean number of points per degree."""
    return max(int(1e6 / sample_us / scan_hz) / 360 + 1, 1.0)


def _in_cells(points: Sequence[Point], per_degree: float) -> list[tuple[float, float]]:
    count, width = int(360 * per_degree), math.ceil(per_degree)
    cells: list[tuple[float, float]] = [(0.0, 0.0)] * count
    for angle, distance_mm, quality in points:
        begin = int(angle * per_degree)
        for cell in range(begin, begin + width):
            cells[min(cell, count - 1)] = distance_mm, quality
    return cells


def _sorted(turn: Sequence[Point], first: int) -> list[Point]:
    """Sort points by angle. Invalid points get angles as if all points were evenly spaced."""
    step = 360 / len(turn)
    front = turn[first].angle - first * step
    return sorted(
        point if point.distance_mm else point._replace(angle=(front + at * step) % 360)
        for at, point in enumerate(turn)
    )
