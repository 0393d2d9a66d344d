"""Convert laser scans to points in the scan's frame, or in another frame with correction for motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.pose import Pose
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array


def valid_beams(scan: Scan, cutoff: float = -1.0) -> Array:
    """Return the indices of beams with `range_min` <= range < cutoff. A negative cutoff means `range_max`."""
    limit = scan.range_max if cutoff < 0 else cutoff
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((scan.ranges < limit) & (scan.ranges >= scan.range_min))


def projected(scan: Scan, beams: Array) -> Array:
    """Return the points of beams in the scan's frame as a float32 array of shape (n, 3)."""
    angles = scan.angle_min + beams * scan.angle_increment
    ranges = scan.ranges[beams].astype(np.float64)
    points: Array = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(beams))], 1)
    return points.astype(np.float32)


def channels(scan: Scan, beams: Array, names: Mapping[str, bool]) -> dict[str, Array]:
    """Return the requested channels of laser_geometry: intensity, index, distances and stamps."""
    found = {}
    if names.get("intensity") and len(scan.intensities):
        found["intensity"] = np.resize(scan.intensities, len(scan.ranges))[beams]
    if names.get("index"):
        found["index"] = beams.astype(np.int32)
    if names.get("distances"):
        found["distances"] = scan.ranges[beams]
    if names.get("stamps"):
        found["stamps"] = (beams * scan.time_increment).astype(np.float32)
    return found


def poses_of_scan(
    listener: TransformListener, target: str, scan: Scan, *, moves: bool = True
) -> tuple[Pose, Pose]:
    """Return the poses of the scan's frame in `target` at the times of the first and the last beam.

    If `moves` is false, return the pose at the first beam twice.

    Raises:
        TransformException: a pose is not available.
    """
    end_ns = scan.beam_stamp_ns(max(len(scan.ranges) - 1, 0) if moves else 0)
    target, frame = target.removeprefix("/"), scan.frame.removeprefix("/")
    return listener.at(target, frame, scan.stamp_ns), listener.at(target, frame, end_ns)


def moving(points: Array, beams: Array, count: int, poses: tuple[Pose, Pose]) -> Array:
    """Transform the points of a scan whose frame moves between two poses at constant speed.

    `count` is the scan's number of beams. Positions are interpolated linearly, and rotations by slerp.
    """
    start, end = (np.array(each) for each in poses)
    ratio = (beams * (1.0 / (count - 1.0)) if count > 1 else np.zeros(len(beams)))[:, np.newaxis]
    places = (1.0 - ratio) * start[:3] + ratio * end[:3]
    dot = _dot(start[3:], end[3:])
    cosine = abs(dot) / math.sqrt(_dot(start[3:], start[3:]) * _dot(end[3:], end[3:]))
    half = math.acos(min(cosine, 1.0))
    if half == 0.0:
        turns = np.broadcast_to(start[3:], (len(beams), 4))
    else:
        other = -end[3:] if dot < 0 else end[3:]
        turns = start[3:] * np.sin((1.0 - ratio) * half) + other * np.sin(ratio * half)
        turns = turns * (1.0 / math.sin(half))
    found: Array = _turned(turns, points.astype(np.float64)) + places
    return found.astype(np.float32)


def _dot(one: Array, other: Array) -> float:
    x, y, z, w = (one * other).tolist()
    return float(x + y + z + w)


def _turned(quaternions: Array, points: Array) -> Array:
    """Rotate each point by its quaternion (x, y, z, w), with tf's formula for rotation matrices."""
    x, y, z, w = quaternions.T
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    xs, ys, zs = x * scale, y * scale, z * scale
    wx, wy, wz, xx, xy, xz = w * xs, w * ys, w * zs, x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    a, b, c = points.T
    return np.stack(
        [
            (1.0 - (yy + zz)) * a + (xy - wz) * b + (xz + wy) * c,
            (xy + wz) * a + (1.0 - (xx + zz)) * b + (yz - wx) * c,
            (xz - wy) * a + (yz + wx) * b + (1.0 - (xx + yy)) * c,
        ],
        1,
    )
