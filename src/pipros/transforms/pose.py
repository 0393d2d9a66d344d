"""Poses as seven numbers: a position (x, y, z) and an orientation (a quaternion x, y, z, w).

As in tf, the length of a quaternion may differ slightly from one. The formulas are those of tf2, so that
results are the same even then.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, pi, sin, sqrt

Pose = tuple[float, float, float, float, float, float, float]

IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def composed(outer: Pose, inner: Pose) -> Pose:
    """The pose `inner`, given in a frame with the pose `outer`, in the outer frame."""
    ox, oy, oz, x, y, z, w = outer
    vx, vy, vz, a, b, c, d = inner
    if w == 1.0 and x == y == z == 0.0:  # most frames of a robot are not turned
        return (ox + vx, oy + vy, oz + vz, a, b, c, d)
    ix = w * vx + y * vz - z * vy
    iy = w * vy + z * vx - x * vz
    iz = w * vz + x * vy - y * vx
    iw = x * vx + y * vy + z * vz
    return (
        ix * w + iw * x - iy * z + iz * y + ox,
        iy * w + iw * y - iz * x + ix * z + oy,
        iz * w + iw * z - ix * y + iy * x + oz,
        w * a + x * d + y * c - z * b,
        w * b + y * d + z * a - x * c,
        w * c + z * d + x * b - y * a,
        w * d - x * a - y * b - z * c,
    )


def inverted(pose: Pose) -> Pose:
    """The inverse of a pose."""
    x, y, z, a, b, c, d = pose
    back = (0.0, 0.0, 0.0, -a, -b, -c, d)
    return (*composed(back, (-x, -y, -z, -a, -b, -c, d))[:3], -a, -b, -c, d)


def between(older: Pose, newer: Pose, ratio: float) -> Pose:
    """The pose at `ratio` (0 to 1) between two poses.

    It moves on a straight line, and turns the shorter way at constant speed.
    """
    x, y, z, a, b, c, d = older
    u, v, w, e, f, g, h = newer
    rest = 1.0 - ratio
    x, y, z = rest * x + ratio * u, rest * y + ratio * v, rest * z + ratio * w
    if a == e and b == f and c == g and d == h:
        return (x, y, z, a, b, c, d)
    dot = a * e + b * f + c * g + d * h
    cosine = abs(dot) / sqrt((a * a + b * b + c * c + d * d) * (e * e + f * f + g * g + h * h))
    angle = acos(cosine) if cosine < 1.0 else 0.0
    if angle == 0.0:
        return (x, y, z, a, b, c, d)
    sine = sin(angle)
    first, second = sin(rest * angle) / sine, sin(ratio * angle) / sine
    if dot < 0.0:
        second = -second
    return (
        x,
        y,
        z,
        a * first + e * second,
        b * first + f * second,
        c * first + g * second,
        d * first + h * second,
    )


Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A rotation, row by row."""


def rotation_matrix(pose: Pose) -> Matrix:
    """The orientation of the pose as a matrix; the quaternion may have any length but zero."""
    _, _, _, x, y, z, w = pose
    s = 2.0 / (x * x + y * y + z * z + w * w)
    return (
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )


def normalized(pose: Pose) -> Pose:
    """The pose with the quaternion that its matrix gives.

    Of length one, and with the sign that tf2 gives it.
    """
    m = rotation_matrix(pose)
    trace = m[0] + m[4] + m[8]
    if trace > 0.0:
        s = sqrt(trace + 1.0)
        w, s = s * 0.5, 0.5 / s
        return (*pose[:3], (m[7] - m[5]) * s, (m[2] - m[6]) * s, (m[3] - m[1]) * s, w)
    i = (2 if m[4] < m[8] else 1) if m[0] < m[4] else (2 if m[0] < m[8] else 0)
    j, k = (i + 1) % 3, (i + 2) % 3
    s = sqrt(m[4 * i] - m[4 * j] - m[4 * k] + 1.0)
    q = [0.0, 0.0, 0.0]
    q[i], s = s * 0.5, 0.5 / s
    q[j] = (m[3 * j + i] + m[3 * i + j]) * s
    q[k] = (m[3 * k + i] + m[3 * i + k]) * s
    return (*pose[:3], q[0], q[1], q[2], (m[3 * k + j] - m[3 * j + k]) * s)


def composed_exactly(outer: Pose, inner: Pose) -> Pose:
    """As `composed`, by way of matrices, which make all quaternions one long.

    For transforms with two times.
    """
    turned, fixed = normalized(outer), normalized(inner)
    return normalized(composed(turned, fixed))


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """The quaternion that rolls around x, then pitches around y, then yaws around z, all of them fixed."""
    sr, cr = sin(roll / 2.0), cos(roll / 2.0)
    sp, cp = sin(pitch / 2.0), cos(pitch / 2.0)
    sy, cy = sin(yaw / 2.0), cos(yaw / 2.0)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def roll_pitch_yaw(pose: Pose) -> tuple[float, float, float]:
    """The orientation of the pose as angles around x, y and z."""
    m = rotation_matrix(pose)
    if abs(m[6]) >= 1.0:  # it looks straight up or down: roll and yaw turn around the same axis
        upward = m[6] < 0.0
        return (atan2(m[1], m[2]) if upward else atan2(-m[1], -m[2])), (pi / 2 if upward else -pi / 2), 0.0
    return atan2(m[7], m[8]), -asin(m[6]), atan2(m[3], m[0])
