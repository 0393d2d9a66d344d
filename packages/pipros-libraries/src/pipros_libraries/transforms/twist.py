"""Compute the velocities of frames from their poses at the start and end of an interval. Times are in ns."""

from __future__ import annotations

from math import atan2, sqrt

from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.pose import Pose, Vector, composed, inverted, normalized, rotate

_EARLIEST = 100_000
"""Start of the earliest interval. It is not 0, because 0 would mean the latest common time."""


def interval_around(time: int, latest: int, length: int) -> tuple[int, int]:
    """Return the start and end of an interval around `time` that does not end after `latest`."""
    end = min(time + length // 2, latest)
    return max(_EARLIEST, end - length), end


def twist(
    start: Pose, end: Pose, duration: int, tracked: Pose, reference_point: Pose
) -> tuple[Vector, Vector]:
    """Return the linear (m/s) and angular (rad/s) velocity of a frame, like tf's lookupTwistFull.

    Args:
        start, end: poses of the frame relative to the observation frame at the start and end of an interval
            of `duration`.
        tracked: pose of the frame relative to the reference frame, in which the velocities are expressed.
        reference_point: pose of the frame whose origin is the reference point, relative to the reference
            frame.

    The change of the reference point reproduces a bug in Noetic (`vel += numpy.dot(rot, delta[:3])` in
    tf/listener.py; compared in tests/interop): it adds the scalar product of the angular velocity and the
    offset to each component of the linear velocity, although kinematics requires their cross product.
    """
    seconds = duration / NS_PER_S
    start, end, tracked, reference_point = map(normalized, (start, end, tracked, reference_point))
    turned = _rotation_vector(composed(inverted(start), end))
    ax, ay, az = rotate(tracked, (turned[0] / seconds, turned[1] / seconds, turned[2] / seconds))
    dx, dy, dz = ((after - before) / seconds for after, before in zip(end[:3], start[:3], strict=True))
    lx, ly, lz = rotate(tracked, (dx, dy, dz))
    px, py, pz = tracked[:3]
    mx, my, mz = composed(reference_point, tracked)[:3]
    share = ax * (mx - px) + ay * (my - py) + az * (mz - pz)
    linear = (lx + py * az - pz * ay + share, ly + pz * ax - px * az + share, lz + px * ay - py * ax + share)
    return linear, (ax, ay, az)


def _rotation_vector(pose: Pose) -> Vector:
    """Return a pose's rotation vector, which is the axis scaled by the angle in radians (0 to pi)."""
    qx, qy, qz, qw = pose[3:] if pose[6] >= 0.0 else (-number for number in pose[3:])
    length = sqrt(qx * qx + qy * qy + qz * qz)
    factor = 2.0 * atan2(length, qw) / length if length else 2.0
    return qx * factor, qy * factor, qz * factor
