"""Euler angles in their 24 conventions, after K. Shoemake, "Euler angle conversion", Graphics Gems IV.

A convention is a string such as "sxyz": rotations about static (s) or rotating (r) axes, in this order. It is
equivalent to four numbers: the innermost axis (0 to 2), the parity (1 if the order is opposite to x, y, z),
whether the first axis is repeated as the last axis (0 or 1), and whether the axes rotate (0 or 1).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pipros.libraries.transforms.matrices.arrays import EPSILON, Array

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


def euler_matrix(ai: float, aj: float, ak: float, axes: str | Convention = "sxyz") -> Array:
    """Return the 4x4 matrix of a rotation by three angles. Raises KeyError for an unknown convention."""
    inner, parity, repeated, rotating = convention_of(axes)
    i, j, k = axes_of(inner, parity)
    if rotating:
        ai, ak = ak, ai
    if parity:
        ai, aj, ak = -ai, -aj, -ak
    si, sj, sk = math.sin(ai), math.sin(aj), math.sin(ak)
    ci, cj, ck = math.cos(ai), math.cos(aj), math.cos(ak)
    cc, cs, sc, ss = ci * ck, ci * sk, si * ck, si * sk
    matrix = np.identity(4)
    if repeated:
        matrix[i, i], matrix[i, j], matrix[i, k] = cj, sj * si, sj * ci
        matrix[j, i], matrix[j, j], matrix[j, k] = sj * sk, cc - cj * ss, -sc - cj * cs
        matrix[k, i], matrix[k, j], matrix[k, k] = -sj * ck, cj * sc + cs, cj * cc - ss
    else:
        matrix[i, i], matrix[i, j], matrix[i, k] = cj * ck, sj * sc - cs, sj * cc + ss
        matrix[j, i], matrix[j, j], matrix[j, k] = cj * sk, sj * ss + cc, sj * cs - sc
        matrix[k, i], matrix[k, j], matrix[k, k] = -sj, cj * si, cj * ci
    return matrix


def euler_from_matrix(matrix: ArrayLike, axes: str | Convention = "sxyz") -> tuple[float, float, float]:
    """Return three Euler angles for a rotation. They are not unique.

    `matrix` has at least 3 rows and columns. Raises KeyError for an unknown convention.
    """
    inner, parity, repeated, rotating = convention_of(axes)
    i, j, k = axes_of(inner, parity)
    m = np.asarray(matrix, dtype=np.float64)[:3, :3].tolist()
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
