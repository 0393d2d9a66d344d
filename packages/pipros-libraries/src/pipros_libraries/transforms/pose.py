"""Poses, given as seven numbers: a position (px, py, pz) and a quaternion (qx, qy, qz, qw).

As in tf, the norm of a quaternion may differ slightly from 1. The formulas are those of tf2, so that results
are equal even in that case. Composition is from right to left: `composed(outer, inner)` applies `inner`
first.

The package `matrices` offers similar functions, with the formulas and numpy arrays of `tf.transformations`.
Lookups cannot use them, because lookups must not require numpy (an extra that is slow to import), and their
results must equal tf2's bit for bit. `tests/unit/transforms/test_pose_and_matrices.py` compares the
two.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import acos, asin, atan2, cos, pi, sin, sqrt

Pose = tuple[float, float, float, float, float, float, float]

Vector = tuple[float, float, float]

IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def composed(outer: Pose, inner: Pose) -> Pose:
    """Return `outer * inner`: the pose `inner` in the frame `outer`, converted to that frame's parent."""
    return composed_up(inner, (outer,))


def composed_up(pose: Pose, frames: Iterable[Pose]) -> Pose:
    """Convert a pose from a frame to its parent, from there to the next parent, and so on.

    `frames` contains the poses of these frames, each relative to its parent.
    """
    # a loop instead of calls to `composed`, because lookups spend most of their time here
    px, py, pz, qx, qy, qz, qw = pose
    for opx, opy, opz, oqx, oqy, oqz, oqw in frames:
        # Two fast paths, because most frames of a robot are not rotated, or only about the z axis. These
        # paths omit products with zeros from the formulas below.
        if oqx == 0.0 and oqy == 0.0:
            if oqz == 0.0 and oqw == 1.0:
                px, py, pz = opx + px, opy + py, opz + pz
                continue
            ix, iy, iz, iw = oqw * px - oqz * py, oqw * py + oqz * px, oqw * pz, oqz * pz
            px, py, pz = ix * oqw - iy * oqz + opx, iy * oqw + ix * oqz + opy, iz * oqw + iw * oqz + opz
            qx, qy, qz, qw = (
                oqw * qx - oqz * qy,
                oqw * qy + oqz * qx,
                oqw * qz + oqz * qw,
                oqw * qw - oqz * qz,
            )
            continue
        # (ix, iy, iz, -iw) is the product of the outer quaternion and the position.
        ix = oqw * px + oqy * pz - oqz * py
        iy = oqw * py + oqz * px - oqx * pz
        iz = oqw * pz + oqx * py - oqy * px
        iw = oqx * px + oqy * py + oqz * pz
        px = ix * oqw + iw * oqx - iy * oqz + iz * oqy + opx
        py = iy * oqw + iw * oqy - iz * oqx + ix * oqz + opy
        pz = iz * oqw + iw * oqz - ix * oqy + iy * oqx + opz
        qx, qy, qz, qw = (
            oqw * qx + oqx * qw + oqy * qz - oqz * qy,
            oqw * qy + oqy * qw + oqz * qx - oqx * qz,
            oqw * qz + oqz * qw + oqx * qy - oqy * qx,
            oqw * qw - oqx * qx - oqy * qy - oqz * qz,
        )
    return (px, py, pz, qx, qy, qz, qw)


def joined(up: list[Pose], down: list[Pose]) -> Pose:
    """Return the pose of a source relative to a target.

    `up` and `down` are the poses of the frames from the source and from the target up to a common ancestor.
    """
    source = composed_up(up[0], up[1:]) if up else IDENTITY
    if not down:
        return source
    target = inverted(composed_up(down[0], down[1:]))
    return composed(target, source) if up else target


def inverted(pose: Pose) -> Pose:
    """Return the inverse of a pose."""
    # The negated position, rotated by the conjugate quaternion, as in `composed_up`.
    px, py, pz, qx, qy, qz, qw = pose
    ix = qy * pz - qw * px - qz * py
    iy = qz * px - qw * py - qx * pz
    iz = qx * py - qw * pz - qy * px
    iw = qx * px + qy * py + qz * pz
    return (
        ix * qw - iw * qx + iy * qz - iz * qy,
        iy * qw - iw * qy + iz * qx - ix * qz,
        iz * qw - iw * qz + ix * qy - iy * qx,
        -qx,
        -qy,
        -qz,
        qw,
    )


def transform_point(frame: Pose, point: Vector) -> Vector:
    """Convert a point from the frame with the pose `frame` to the parent of that frame."""
    return composed(frame, (*point, *IDENTITY[3:]))[:3]


def rotate(frame: Pose, vector: Vector) -> Vector:
    """Convert a vector from the frame with the pose `frame` to the parent of that frame."""
    return transform_point((*IDENTITY[:3], *frame[3:]), vector)


def interpolate(older: Pose, newer: Pose, ratio: float) -> Pose:
    """Interpolate between two poses. `ratio` is 0 for the older pose and 1 for the newer pose.

    The position is interpolated linearly, the orientation by slerp along the shorter arc.
    """
    px, py, pz, qx, qy, qz, qw = older
    to_px, to_py, to_pz, to_qx, to_qy, to_qz, to_qw = newer
    rest = 1.0 - ratio
    px, py, pz = rest * px + ratio * to_px, rest * py + ratio * to_py, rest * pz + ratio * to_pz
    # As in `composed_up`, omit products with zeros if both rotations are about the z axis.
    if is_flat := not (qx or qy or to_qx or to_qy):
        dot = qz * to_qz + qw * to_qw
        cosine = abs(dot) / sqrt((qz * qz + qw * qw) * (to_qz * to_qz + to_qw * to_qw))
    else:
        dot = qx * to_qx + qy * to_qy + qz * to_qz + qw * to_qw
        cosine = abs(dot) / sqrt(
            (qx * qx + qy * qy + qz * qz + qw * qw)
            * (to_qx * to_qx + to_qy * to_qy + to_qz * to_qz + to_qw * to_qw)
        )
    if not cosine < 1.0:
        return (px, py, pz, qx, qy, qz, qw)
    angle = acos(cosine)
    sine = sin(angle)
    first, second = sin(rest * angle) / sine, sin(ratio * angle) / sine
    if dot < 0.0:
        second = -second
    if is_flat:
        return (px, py, pz, qx, qy, qz * first + to_qz * second, qw * first + to_qw * second)
    return (
        px,
        py,
        pz,
        qx * first + to_qx * second,
        qy * first + to_qy * second,
        qz * first + to_qz * second,
        qw * first + to_qw * second,
    )


Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A 3x3 rotation matrix, row by row."""


def rotation_matrix(pose: Pose) -> Matrix:
    """Return a pose's orientation as a matrix. The quaternion may have any norm except 0."""
    _, _, _, qx, qy, qz, qw = pose
    s = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
    return (
        1.0 - s * (qy * qy + qz * qz),
        s * (qx * qy - qw * qz),
        s * (qx * qz + qw * qy),
        s * (qx * qy + qw * qz),
        1.0 - s * (qx * qx + qz * qz),
        s * (qy * qz - qw * qx),
        s * (qx * qz - qw * qy),
        s * (qy * qz + qw * qx),
        1.0 - s * (qx * qx + qy * qy),
    )


def normalized(pose: Pose) -> Pose:
    """Return the pose with a quaternion of norm 1, computed via the rotation matrix.

    This gives the quaternion the same sign as in tf2.
    """
    m = rotation_matrix(pose)
    trace = m[0] + m[4] + m[8]
    if trace > 0.0:
        s = sqrt(trace + 1.0)
        qw, s = s * 0.5, 0.5 / s
        return (*pose[:3], (m[7] - m[5]) * s, (m[2] - m[6]) * s, (m[3] - m[1]) * s, qw)
    i = (2 if m[4] < m[8] else 1) if m[0] < m[4] else (2 if m[0] < m[8] else 0)
    j, k = (i + 1) % 3, (i + 2) % 3
    s = sqrt(m[4 * i] - m[4 * j] - m[4 * k] + 1.0)
    q = [0.0, 0.0, 0.0]
    q[i], s = s * 0.5, 0.5 / s
    q[j] = (m[3 * j + i] + m[3 * i + j]) * s
    q[k] = (m[3 * k + i] + m[3 * i + k]) * s
    return (*pose[:3], q[0], q[1], q[2], (m[3 * k + j] - m[3 * j + k]) * s)


def compose_via_matrices(outer: Pose, inner: Pose) -> Pose:
    """Like `composed`, but use rotation matrices, which normalizes all quaternions.

    tf2 composes transforms at two different times in this way.
    """
    return normalized(composed(normalized(outer), normalized(inner)))


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) for rotations about the fixed axes x, y and z, in that order.

    Angles are in radians.
    """
    sr, cr = sin(roll / 2.0), cos(roll / 2.0)
    sp, cp = sin(pitch / 2.0), cos(pitch / 2.0)
    sy, cy = sin(yaw / 2.0), cos(yaw / 2.0)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def roll_pitch_yaw(pose: Pose) -> Vector:
    """Return a pose's orientation as angles in radians about the fixed axes x, y and z."""
    m = rotation_matrix(pose)
    if abs(m[6]) >= 1.0:  # In gimbal lock, roll and yaw have the same axis.
        upward = m[6] < 0.0
        return (atan2(m[1], m[2]) if upward else atan2(-m[1], -m[2])), (pi / 2 if upward else -pi / 2), 0.0
    return atan2(m[7], m[8]), -asin(m[6]), atan2(m[3], m[0])
