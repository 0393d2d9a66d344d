"""What one sensor saw: points in the costmap's frame, kept for some time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, takewhile
from typing import Any

import numpy as np
import numpy.typing as npt

from pipros.libraries.transforms.pose import Pose, rotation_matrix
from pipros.navigation.costmap.grid import Numbers

Points3D = npt.NDArray[np.float32]

_FLOAT32 = 7  # of sensor_msgs/PointField


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """The parameters of an observation source, under their names: distances in metres, times in seconds."""

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
    """One message of a sensor: the sensor's position, and the points that it saw, one per row."""

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
        """Add points of a frame with the pose `cloud`. Keep at most `limit` points in all observations.

        Points outside the heights of the source and those that are not finite are dropped.
        """
        placed = _placed(points[np.isfinite(points).all(axis=1)], cloud)
        height = placed[:, 2]
        chosen = (height >= self.settings.min_obstacle_height) & (height <= self.settings.max_obstacle_height)
        self._kept.insert(0, Observation(sensor[:3], placed[chosen], stamp_ns))
        self._updated_ns = now_ns
        totals = accumulate(len(each.points) for each in self._kept)
        fits = [total <= limit for total in totals]
        del self._kept[max(1, sum(fits)) :]

    def touch(self, now_ns: int) -> None:
        """Count the time of `expected_update_rate` from now on."""
        self._updated_ns = now_ns

    def clear(self) -> None:
        """Forget all observations."""
        self._kept.clear()

    def observations(self) -> list[Observation]:
        """Return the observations that are not older than the time to keep before the newest arrival."""
        keep_ns = round(self.settings.observation_persistence * 1e9)
        if not keep_ns:
            del self._kept[1:]
        elif self._updated_ns is not None:
            oldest_ns = self._updated_ns - keep_ns
            self._kept = list(takewhile(lambda each: each.stamp_ns >= oldest_ns, self._kept))
        return list(self._kept)

    def is_current(self, now_ns: int) -> bool:
        """Return whether the newest observation arrived in time."""
        limit_ns = round(self.settings.expected_update_rate * 1e9)
        return not limit_ns or self._updated_ns is None or now_ns - self._updated_ns <= limit_ns


def scan_points(scan: Any, *, is_infinity_valid: bool = False) -> Points3D:
    """Return the points of a `sensor_msgs/LaserScan` in its frame. Invalid ranges give no point.

    A range is valid if range_min <= range < range_max. With `is_infinity_valid`, an infinite one counts as
    just below range_max.
    """
    ranges = np.asarray(scan.ranges, np.float32)
    if is_infinity_valid:
        ranges = np.where(np.isposinf(ranges), np.float32(scan.range_max) - np.float32(0.0001), ranges)
    with np.errstate(all="ignore"):  # angles that are not finite give no point
        angles = scan.angle_min + np.arange(len(ranges)) * scan.angle_increment
    chosen = (ranges < scan.range_max) & (ranges >= scan.range_min) & np.isfinite(angles)
    points = np.zeros((int(chosen.sum()), 3), np.float32)
    points[:, 0] = ranges[chosen] * np.cos(angles[chosen])
    points[:, 1] = ranges[chosen] * np.sin(angles[chosen])
    return points


def cloud_points(cloud: Any) -> Points3D:
    """Return the points of a `sensor_msgs/PointCloud2`.

    Raises:
        ValueError: a field of x, y and z is missing, or the data is too short.
    """
    offsets = {field.name: field.offset for field in cloud.fields if field.datatype == _FLOAT32}
    count, size = cloud.width * cloud.height, cloud.point_step
    if any(name not in offsets or offsets[name] + 4 > size for name in "xyz"):
        raise ValueError("a cloud must have the fields x, y and z of type FLOAT32 within its points")
    if len(cloud.data) < count * size:
        raise ValueError(
            f"a cloud of {count} points of {size} bytes must have more data, got {len(cloud.data)}"
        )
    kind = ">f4" if cloud.is_bigendian else "<f4"
    places = [offsets[name] for name in "xyz"]
    layout: Any = {"names": list("xyz"), "formats": [kind] * 3, "offsets": places, "itemsize": size}
    rows = np.frombuffer(cloud.data, np.dtype(layout), count) if count else np.empty(0, np.dtype(layout))
    return np.stack([rows[name].astype(np.float32) for name in "xyz"], axis=1)


def old_cloud_points(cloud: Any) -> Points3D:
    """Return the points of a `sensor_msgs/PointCloud`."""
    return np.array([(point.x, point.y, point.z) for point in cloud.points], np.float32).reshape(-1, 3)


def _placed(points: Points3D, frame: Pose) -> Points3D:
    """Convert points from the frame with a pose to its parent, with the rounding of tf2_sensor_msgs."""
    x, y, z = points.T
    turn = np.array(rotation_matrix(frame), np.float32).reshape(3, 3)
    rows = [turn[at, 0] * x + turn[at, 1] * y + turn[at, 2] * z + np.float32(frame[at]) for at in range(3)]
    return np.stack(rows, axis=1)


def squared_distances(points: Points3D, origin: tuple[float, float, float]) -> Numbers:
    """Return the squared distance of each point from a position."""
    squares: Numbers = (points.astype(np.float64) - origin) ** 2
    return squares.sum(axis=1)  # type: ignore[no-any-return]
