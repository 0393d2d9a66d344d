"""Quaternions, as arrays (qx, qy, qz, qw) of shape (4,)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pipros.libraries.transforms.matrices.arrays import EPSILON, Array, unit_vector
from pipros.libraries.transforms.matrices.euler import Convention, axes_of, convention_of, euler_from_matrix


def quaternion_about_axis(angle: float, axis: ArrayLike) -> Array:
    """Return the quaternion for a rotation by `angle` about `axis`, a vector of any length except 0."""
    x, y, z = np.asarray(axis, dtype=np.float64)[:3].tolist()
    length = math.sqrt(x * x + y * y + z * z)
    factor = math.sin(angle / 2.0) / length if length > EPSILON else 1.0
    return np.array((x * factor, y * factor, z * factor, math.cos(angle / 2.0)))


def quaternion_matrix(quaternion: ArrayLike) -> Array:
    """Return the 4x4 rotation matrix for a quaternion of any norm, or the identity if the norm is 0."""
    qx, qy, qz, qw = np.asarray(quaternion, dtype=np.float64)[:4].tolist()
    square = qx * qx + qy * qy + qz * qz + qw * qw
    if square < EPSILON:
        return np.identity(4)
    s = 2.0 / square
    return np.array(
        (
            (1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qz * qw), s * (qx * qz + qy * qw), 0.0),
            (s * (qx * qy + qz * qw), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qx * qw), 0.0),
            (s * (qx * qz - qy * qw), s * (qy * qz + qx * qw), 1.0 - s * (qx * qx + qy * qy), 0.0),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def quaternion_from_matrix(matrix: ArrayLike) -> Array:
    """Return the rotation of a 4x4 matrix as a quaternion of norm 1."""
    m = np.asarray(matrix, dtype=np.float64)[:4, :4].tolist()
    trace = m[0][0] + m[1][1] + m[2][2] + m[3][3]
    parts = [0.0, 0.0, 0.0, trace]
    if trace > m[3][3]:
        for axis in range(3):
            after, before = (axis + 1) % 3, (axis + 2) % 3
            parts[axis] = m[before][after] - m[after][before]
    else:
        # Start with the largest of x, y and z, because dividing by a small number would lose precision.
        i = 0
        if m[1][1] > m[0][0]:
            i = 1
        if m[2][2] > m[i][i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        trace = m[i][i] - (m[j][j] + m[k][k]) + m[3][3]
        parts[i] = trace
        parts[j] = m[i][j] + m[j][i]
        parts[k] = m[k][i] + m[i][k]
        parts[3] = m[k][j] - m[j][k]
    return np.array(parts) * (0.5 / math.sqrt(trace * m[3][3]))


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str | Convention = "sxyz") -> Array:
    """Return the quaternion for three Euler angles. Raises KeyError for an unknown convention."""
    inner, parity, repeated, rotating = convention_of(axes)
    i, j, k = axes_of(inner, parity)
    if rotating:
        ai, ak = ak, ai
    if parity:
        aj = -aj
    si, sj, sk = math.sin(ai / 2.0), math.sin(aj / 2.0), math.sin(ak / 2.0)
    ci, cj, ck = math.cos(ai / 2.0), math.cos(aj / 2.0), math.cos(ak / 2.0)
    cc, cs, sc, ss = ci * ck, ci * sk, si * ck, si * sk
    parts = [0.0, 0.0, 0.0, 0.0]
    if repeated:
        parts[i], parts[j], parts[k], parts[3] = (
            cj * (cs + sc),
            sj * (cc + ss),
            sj * (cs - sc),
            cj * (cc - ss),
        )
    else:
        parts[i], parts[j], parts[k] = cj * sc - sj * cs, cj * ss + sj * cc, cj * cs - sj * sc
        parts[3] = cj * cc + sj * ss
    if parity:
        parts[j] = -parts[j]
    return np.array(parts)


def euler_from_quaternion(
    quaternion: ArrayLike, axes: str | Convention = "sxyz"
) -> tuple[float, float, float]:
    """Return three Euler angles for a quaternion. Raises KeyError for an unknown convention."""
    return euler_from_matrix(quaternion_matrix(quaternion), axes)


def quaternion_multiply(quaternion1: ArrayLike, quaternion0: ArrayLike) -> Array:
    """Return the product `quaternion1 * quaternion0`, which applies the rotation `quaternion0` first."""
    qx0, qy0, qz0, qw0 = np.asarray(quaternion0, dtype=np.float64).tolist()
    qx1, qy1, qz1, qw1 = np.asarray(quaternion1, dtype=np.float64).tolist()
    return np.array(
        (
            qw1 * qx0 + qx1 * qw0 + qy1 * qz0 - qz1 * qy0,
            qw1 * qy0 + qy1 * qw0 + qz1 * qx0 - qx1 * qz0,
            qw1 * qz0 + qz1 * qw0 + qx1 * qy0 - qy1 * qx0,
            qw1 * qw0 - qx1 * qx0 - qy1 * qy0 - qz1 * qz0,
        )
    )


def quaternion_conjugate(quaternion: ArrayLike) -> Array:
    """Return the conjugate (-qx, -qy, -qz, qw)."""
    qx, qy, qz, qw = np.asarray(quaternion, dtype=np.float64).tolist()
    return np.array((-qx, -qy, -qz, qw))


def quaternion_inverse(quaternion: ArrayLike) -> Array:
    """Return the inverse quaternion."""
    given = np.asarray(quaternion, dtype=np.float64)
    return quaternion_conjugate(given) / float(given @ given)


def quaternion_slerp(
    quat0: ArrayLike, quat1: ArrayLike, fraction: float, spin: int = 0, shortestpath: bool = True
) -> Array:
    """Interpolate between two quaternions (slerp). `fraction` is 0 for `quat0` and 1 for `quat1`.

    Args:
        spin: number of additional half turns.
        shortestpath: whether to interpolate along the shorter arc.
    """
    start: Array = unit_vector(np.asarray(quat0, dtype=np.float64)[:4])
    end: Array = unit_vector(np.asarray(quat1, dtype=np.float64)[:4])
    if fraction == 0.0:
        return start
    if fraction == 1.0:
        return end
    cosine = float(start @ end)
    if abs(abs(cosine) - 1.0) < EPSILON:
        return start
    if shortestpath and cosine < 0.0:
        cosine, end = -cosine, -end
    angle = math.acos(cosine) + spin * math.pi
    if abs(angle) < EPSILON:
        return start
    sine = math.sin(angle)
    return start * (math.sin((1.0 - fraction) * angle) / sine) + end * (math.sin(fraction * angle) / sine)


def random_quaternion(rand: ArrayLike | None = None) -> Array:
    """Return a uniformly distributed random unit quaternion.

    `rand` contains the three random numbers in [0, 1] to use. Raises ValueError if it has another length.
    Method: K. Shoemake, "Uniform random rotations", Graphics Gems III.
    """
    if rand is None:
        drawn = np.random.rand(3)  # numpy.random.seed seeds this generator, as scripts expect
    else:
        drawn = np.asarray(rand, dtype=np.float64)
        if len(drawn) != 3:
            raise ValueError(f"rand must have 3 numbers, got {len(drawn)}")
    share, first, second = drawn.tolist()
    one, other = math.sqrt(1.0 - share), math.sqrt(share)
    turn = 2.0 * math.pi
    return np.array(
        (
            math.sin(turn * first) * one,
            math.cos(turn * first) * one,
            math.sin(turn * second) * other,
            math.cos(turn * second) * other,
        )
    )


def random_rotation_matrix(rand: ArrayLike | None = None) -> Array:
    """Return a random rotation as a 4x4 matrix; see `random_quaternion` for `rand`."""
    return quaternion_matrix(random_quaternion(rand))
