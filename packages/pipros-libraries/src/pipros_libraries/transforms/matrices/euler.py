"""Matrices of Euler angles, in the 24 conventions of `transforms.rotations`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms.matrices.arrays import Array
from pipros_libraries.transforms.rotations import CONVENTIONS as CONVENTIONS
from pipros_libraries.transforms.rotations import NAMES as NAMES
from pipros_libraries.transforms.rotations import Convention, axes_of, convention_of, euler_from_rows


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
    return euler_from_rows(np.asarray(matrix, dtype=np.float64)[:3, :3].tolist(), axes)
