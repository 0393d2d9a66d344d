"""The observations of one sensor: points in the costmap's frame, kept for some time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, takewhile
from typing import Any

import numpy as np
import numpy.typing as npt

from pipros.basics.intervals import elapsed
from pipros_libraries.transforms.pose import Pose
from pipros_robot.navigation.costmap.grid import Numbers
from pipros_robot.perception.clouds.points import exact_matrix_of, moved, positions, rows_of
from pipros_robot.perception.laser.projection import projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

Points3D = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """The parameters of an observation source by their ROS names. Units are metres and seconds."""

    topic: str
    data_type: str = "PointCloud"
    sensor_frame: str = ""
    observation_persistence: float = 0.0
    expected_update_rate: float = 0.0
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 2.0
    inf_is_valid: bool = False
    marking: bool = True
    clearing: bool = False
    obstacle_range: float = 2.5
    raytrace_range: float = 3.0


@dataclass(frozen=True, slots=True)
class Observation:
    """The contents of one sensor message: the sensor's position, and the measured points, one per row."""

    origin: tuple[float, float, float]
    points: Points3D
    stamp_ns: int


class ObservationSource:
    """The observations of one sensor, newest first."""

    def __init__(self, settings: SourceSettings) -> None:
        self.settings = settings
        self._kept: list[Observation] = []
        self._updated_ns: int | None = None

    def add(
        self, points: Points3D, cloud: Pose, sensor: Pose, stamp_ns: int, now_ns: int, limit: int
    ) -> None:
        """Add an observation. Drop the oldest earlier observations if there are more than `limit` points.

        `cloud` and `sensor` are the poses of the points' frame and of the sensor in the costmap's frame.
        Points that are not finite or outside the source's range of heights are dropped.
        """
        placed = moved(points[np.isfinite(points).all(axis=1)], exact_matrix_of(cloud))
        height = placed[:, 2]
        chosen = (height >= self.settings.min_obstacle_height) & (height <= self.settings.max_obstacle_height)
        if self._updated_ns is not None and now_ns < self._updated_ns:  # the clock has jumped back
            self._kept.clear()
        self._kept.insert(0, Observation(sensor[:3], placed[chosen], stamp_ns))
        self._updated_ns = now_ns
        totals = accumulate(len(each.points) for each in self._kept)
        fits = [total <= limit for total in totals]
        del self._kept[max(1, sum(fits)) :]

    def touch(self, now_ns: int) -> None:
        """Restart the interval of `expected_update_rate`."""
        self._updated_ns = now_ns

    def clear(self) -> None:
        """Discard all observations."""
        self._kept.clear()

    def observations(self) -> list[Observation]:
        """Return the observations with timestamps up to `observation_persistence` before the last arrival.

        If `observation_persistence` is 0, return only the newest observation.
        """
        keep_ns = round(self.settings.observation_persistence * 1e9)
        if not keep_ns:
            del self._kept[1:]
        elif self._updated_ns is not None:
            oldest_ns = self._updated_ns - keep_ns
            self._kept = list(takewhile(lambda each: each.stamp_ns >= oldest_ns, self._kept))
        return list(self._kept)

    def is_current(self, now_ns: int) -> bool:
        """Return False if nothing came for `expected_update_rate` seconds, unless it is 0; see `touch`."""
        limit_ns = round(self.settings.expected_update_rate * 1e9)
        return not limit_ns or self._updated_ns is None or elapsed(now_ns, self._updated_ns) <= limit_ns


def scan_points(message: Any, *, is_infinity_valid: bool = False) -> Points3D:
    """Return the points of a `sensor_msgs/LaserScan` in its frame. Invalid ranges produce no points.

    A range is valid if range_min <= range < range_max. If `is_infinity_valid` is true, positive infinity
    counts as slightly less than range_max.
    """
    scan = Scan.of(message)
    if is_infinity_valid:
        longest = np.float32(scan.range_max) - np.float32(0.0001)
        scan = scan.with_ranges(np.where(np.isposinf(scan.ranges), longest, scan.ranges))
    with np.errstate(all="ignore"):  # non-finite angles produce no points
        points = projected(scan, valid_beams(scan))
    finite: Points3D = points[np.isfinite(points).all(axis=1)]
    return finite


def cloud_points(cloud: Any) -> Points3D:
    """Return the points of a `sensor_msgs/PointCloud2`.

    Raises:
        ValueError: x, y or z of type FLOAT32 is missing, or the length of the data does not match.
    """
    points: Points3D = positions(cloud, rows_of(cloud))
    return points


def old_cloud_points(cloud: Any) -> Points3D:
    """Return the points of a `sensor_msgs/PointCloud`."""
    return np.array([(point.x, point.y, point.z) for point in cloud.points], np.float32).reshape(-1, 3)


def squared_distances(points: Points3D, origin: tuple[float, float, float]) -> Numbers:
    """Return the squared distance of each point from a position."""
    squares: Numbers = (points.astype(np.float64) - origin) ** 2
    return squares.sum(axis=1)  # type: ignore[no-any-return]
