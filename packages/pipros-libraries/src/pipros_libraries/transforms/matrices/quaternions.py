"""Quaternions, as arrays (qx, qy, qz, qw) of shape (4,)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms import rotations
from pipros_libraries.transforms.matrices.arrays import EPSILON, Array, unit_vector
from pipros_libraries.transforms.rotations import Convention


def quaternion_about_axis(angle: float, axis: ArrayLike) -> Array:
    """Return the quaternion for a rotation by `angle` about `axis`, a vector of any length except 0."""
    return np.array(rotations.quaternion_about_axis(angle, np.asarray(axis, dtype=np.float64).tolist()))


def quaternion_matrix(quaternion: ArrayLike) -> Array:
    """Return the 4x4 rotation matrix for a quaternion of any norm, or the identity if the norm is 0."""
    result = np.identity(4)
    result[:3, :3] = rotations.rows_of(np.asarray(quaternion, dtype=np.float64).tolist())
    return result


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
    return np.array(rotations.quaternion_from_euler(ai, aj, ak, axes))


def euler_from_quaternion(
    quaternion: ArrayLike, axes: str | Convention = "sxyz"
) -> tuple[float, float, float]:
    """Return three Euler angles for a quaternion. Raises KeyError for an unknown convention."""
    return rotations.euler_from_quaternion(np.asarray(quaternion, dtype=np.float64).tolist(), axes)


def quaternion_multiply(quaternion1: ArrayLike, quaternion0: ArrayLike) -> Array:
    """Return the product `quaternion1 * quaternion0`, which applies the rotation `quaternion0` first."""
    first, second = (np.asarray(each, dtype=np.float64).tolist() for each in (quaternion0, quaternion1))
    return np.array(rotations.quaternion_multiply(second, first))


def quaternion_conjugate(quaternion: ArrayLike) -> Array:
    """Return the conjugate (-qx, -qy, -qz, qw)."""
    return np.array(rotations.quaternion_conjugate(np.asarray(quaternion, dtype=np.float64).tolist()))


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
