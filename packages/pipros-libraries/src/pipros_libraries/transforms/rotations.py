"""Quaternions and Euler angles with the formulas of `tf.transformations`, as tuples and without numpy.

Quaternions are (qx, qy, qz, qw), angles in radians. Euler angles have 24 conventions, after K. Shoemake,
"Euler angle conversion", Graphics Gems IV. A convention is a string such as "sxyz": rotations about static
(s) or rotating (r) axes, in this order. It is equivalent to four numbers: the innermost axis (0 to 2), the
parity (1 if the order is opposite to x, y, z), whether the first axis is repeated as the last axis (0 or 1),
and whether the axes rotate (0 or 1).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

EPSILON = sys.float_info.epsilon * 4.0
"""Threshold below which numbers are treated as zero: tf's `_EPS`."""

Quaternion = tuple[float, float, float, float]
Row = tuple[float, float, float]
Rows = tuple[Row, Row, Row]
"""A rotation, as the rows of a 3x3 matrix."""

Convention = tuple[int, int, int, int]


def _conventions() -> dict[str, Convention]:
    found: dict[str, Convention] = {}
    for rotating in (0, 1):
        for inner in range(3):
            for parity in (0, 1):
                for repeated in (0, 1):
                    i, j, k = axes_of(inner, parity)
                    letters = "".join("xyz"[axis] for axis in (i, j, i if repeated else k))
                    name = "r" + letters[::-1] if rotating else "s" + letters
                    found[name] = (inner, parity, repeated, rotating)
    return found


def axes_of(inner: int, parity: int) -> tuple[int, int, int]:
    """Return the indices of the three axes, in the order that a convention specifies."""
    if parity:
        return inner, (inner + 2) % 3, (inner + 1) % 3
    return inner, (inner + 1) % 3, (inner + 2) % 3


CONVENTIONS = _conventions()
NAMES = {convention: name for name, convention in CONVENTIONS.items()}


def convention_of(axes: str | Convention) -> Convention:
    """Return the four numbers of a convention. Raises KeyError if the convention is unknown."""
    name = axes.lower() if isinstance(axes, str) else NAMES.get(axes, "")
    found = CONVENTIONS.get(name)
    if found is None:
        raise KeyError(axes)
    return found


def quaternion_about_axis(angle: float, axis: Sequence[float]) -> Quaternion:
    """Return the quaternion for a rotation by `angle` about `axis`, a vector of any length except 0."""
    x, y, z = map(float, axis[:3])
    length = math.sqrt(x * x + y * y + z * z)
    factor = math.sin(angle / 2.0) / length if length > EPSILON else 1.0
    return x * factor, y * factor, z * factor, math.cos(angle / 2.0)


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str | Convention = "sxyz") -> Quaternion:
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
    return parts[0], parts[1], parts[2], parts[3]


def euler_from_quaternion(
    quaternion: Sequence[float], axes: str | Convention = "sxyz"
) -> tuple[float, float, float]:
    """Return three Euler angles for a quaternion. Raises KeyError for an unknown convention."""
    return euler_from_rows(rows_of(quaternion), axes)


def rows_of(quaternion: Sequence[float]) -> Rows:
    """Return the rotation of a quaternion of any norm, or the identity if the norm is 0."""
    qx, qy, qz, qw = map(float, quaternion[:4])
    square = qx * qx + qy * qy + qz * qz + qw * qw
    if square < EPSILON:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    s = 2.0 / square
    return (
        (1.0 - s * (qy * qy + qz * qz), s * (qx * qy - qz * qw), s * (qx * qz + qy * qw)),
        (s * (qx * qy + qz * qw), 1.0 - s * (qx * qx + qz * qz), s * (qy * qz - qx * qw)),
        (s * (qx * qz - qy * qw), s * (qy * qz + qx * qw), 1.0 - s * (qx * qx + qy * qy)),
    )


def euler_from_rows(m: Sequence[Sequence[float]], axes: str | Convention = "sxyz") -> Row:
    """Return three Euler angles for the rotation with the rows `m`. They are not unique.

    Raises KeyError for an unknown convention.
    """
    inner, parity, repeated, rotating = convention_of(axes)
    i, j, k = axes_of(inner, parity)
    if repeated:
        sine = math.sqrt(m[i][j] ** 2 + m[i][k] ** 2)
        degenerate = sine <= EPSILON
        first = math.atan2(-m[j][k], m[j][j]) if degenerate else math.atan2(m[i][j], m[i][k])
        middle = math.atan2(sine, m[i][i])
        last = 0.0 if degenerate else math.atan2(m[j][i], -m[k][i])
    else:
        cosine = math.sqrt(m[i][i] ** 2 + m[j][i] ** 2)
        degenerate = cosine <= EPSILON
        first = math.atan2(-m[j][k], m[j][j]) if degenerate else math.atan2(m[k][j], m[k][k])
        middle = math.atan2(-m[k][i], cosine)
        last = 0.0 if degenerate else math.atan2(m[j][i], m[i][i])
    if parity:
        first, middle, last = -first, -middle, -last
    return (last, middle, first) if rotating else (first, middle, last)


def quaternion_multiply(quaternion1: Sequence[float], quaternion0: Sequence[float]) -> Quaternion:
    """Return the product `quaternion1 * quaternion0`, which applies the rotation `quaternion0` first."""
    qx0, qy0, qz0, qw0 = map(float, quaternion0)
    qx1, qy1, qz1, qw1 = map(float, quaternion1)
    return (
        qw1 * qx0 + qx1 * qw0 + qy1 * qz0 - qz1 * qy0,
        qw1 * qy0 + qy1 * qw0 + qz1 * qx0 - qx1 * qz0,
        qw1 * qz0 + qz1 * qw0 + qx1 * qy0 - qy1 * qx0,
        qw1 * qw0 - qx1 * qx0 - qy1 * qy0 - qz1 * qz0,
    )


def quaternion_conjugate(quaternion: Sequence[float]) -> Quaternion:
    """Return the conjugate (-qx, -qy, -qz, qw)."""
    qx, qy, qz, qw = map(float, quaternion)
    return -qx, -qy, -qz, qw


def quaternion_inverse(quaternion: Sequence[float]) -> Quaternion:
    """Return the inverse quaternion."""
    square = math.fsum(float(part) ** 2 for part in quaternion)
    qx, qy, qz, qw = quaternion_conjugate(quaternion)
    return qx / square, qy / square, qz / square, qw / square


def without_numpy(module: str, error: ImportError) -> None:
    """Put the functions that need no numpy into a module. Access to any other name raises `error`."""

    def get(name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        raise error.with_traceback(None)

    functions = (
        euler_from_quaternion,
        quaternion_about_axis,
        quaternion_conjugate,
        quaternion_from_euler,
        quaternion_inverse,
        quaternion_multiply,
    )
    vars(sys.modules[module]).update({each.__name__: each for each in functions}, __getattr__=get)
