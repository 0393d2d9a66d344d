"""Create translation, reflection, rotation, scale and shear matrices, and recover their parameters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms.matrices.arrays import (
    EIGENVALUE_TOLERANCE,
    Array,
    fixed_point,
    real_eigenvector,
    unit_vector,
)


def first_three(vector: ArrayLike) -> Array:
    """Return the first three coordinates of a vector of shape (3,), or (4,) if it is homogeneous."""
    return np.array(vector, dtype=np.float64)[:3]


def translation_matrix(direction: ArrayLike) -> Array:
    """Return the matrix that translates by `direction`."""
    matrix = np.identity(4)
    matrix[:3, 3] = first_three(direction)
    return matrix


def translation_from_matrix(matrix: ArrayLike) -> Array:
    """Return the translation of a matrix."""
    return np.array(matrix)[:3, 3].copy()


def reflection_matrix(point: ArrayLike, normal: ArrayLike) -> Array:
    """Return the matrix that reflects in the plane through `point` with the normal vector `normal`."""
    unit = unit_vector(first_three(normal))
    matrix = np.identity(4)
    matrix[:3, :3] -= 2.0 * np.outer(unit, unit)
    matrix[:3, 3] = 2.0 * (first_three(point) @ unit) * unit
    return matrix


def reflection_from_matrix(matrix: ArrayLike) -> tuple[Array, Array]:
    """Return a point on the mirror plane, in homogeneous coordinates (shape (4,)), and the normal vector.

    Raises ValueError if `matrix` is not a reflection.
    """
    mirror = np.array(matrix, dtype=np.float64)
    normal = real_eigenvector(mirror[:3, :3], -1.0, last=False)
    if normal is None:
        raise ValueError("matrix must be a reflection, but has no eigenvalue -1")
    return fixed_point(mirror), normal


def rotation_matrix(angle: float, direction: ArrayLike, point: ArrayLike | None = None) -> Array:
    """Return the matrix that rotates by `angle` about the axis `direction`.

    The axis passes through `point`, by default the origin.
    """
    x, y, z = (float(part) for part in unit_vector(first_three(direction)))
    sine, cosine = math.sin(angle), math.cos(angle)
    rest = 1.0 - cosine
    matrix = np.identity(4)
    matrix[:3, :3] = (
        (cosine + rest * x * x, rest * x * y - sine * z, rest * x * z + sine * y),
        (rest * x * y + sine * z, cosine + rest * y * y, rest * y * z - sine * x),
        (rest * x * z - sine * y, rest * y * z + sine * x, cosine + rest * z * z),
    )
    if point is not None:
        kept = first_three(point)
        matrix[:3, 3] = kept - matrix[:3, :3] @ kept
    return matrix


def rotation_from_matrix(matrix: ArrayLike) -> tuple[float, Array, Array]:
    """Return the angle, the direction of the axis, and a point on the axis (homogeneous, shape (4,)).

    Raises ValueError if `matrix` is not a rotation.
    """
    rotation = np.array(matrix, dtype=np.float64)
    turned = rotation[:3, :3]
    axis = real_eigenvector(turned.T, 1.0)
    if axis is None:
        raise ValueError("matrix must be a rotation, but has no eigenvalue 1")
    point = fixed_point(rotation)
    cosine = (float(np.trace(turned)) - 1.0) / 2.0
    # Each non-zero component of the axis determines the sine. Use the last one.
    i, j, k = (1, 0, 2)
    if abs(axis[2]) <= EIGENVALUE_TOLERANCE:
        i, j, k = (0, 2, 1) if abs(axis[1]) > EIGENVALUE_TOLERANCE else (2, 1, 0)
    sine = (turned[i, j] + (cosine - 1.0) * axis[i] * axis[j]) / axis[k]
    return math.atan2(sine, cosine), axis, point


def scale_matrix(factor: float, origin: ArrayLike | None = None, direction: ArrayLike | None = None) -> Array:
    """Return the matrix that scales by `factor` about `origin`, in all directions or along `direction`."""
    matrix = np.identity(4)
    if direction is None:
        matrix[:3, :3] *= factor
        if origin is not None:
            matrix[:3, 3] = (1.0 - factor) * first_three(origin)
        return matrix
    unit = unit_vector(first_three(direction))
    matrix[:3, :3] -= (1.0 - factor) * np.outer(unit, unit)
    if origin is not None:
        matrix[:3, 3] = (1.0 - factor) * (first_three(origin) @ unit) * unit
    return matrix


def scale_from_matrix(matrix: ArrayLike) -> tuple[float, Array, Array | None]:
    """Return the factor, the origin in homogeneous coordinates (shape (4,)), and the direction of scaling.

    The direction is None if scaling is uniform. Raises ValueError if the matrix has no fixed point.
    """
    scaling = np.array(matrix, dtype=np.float64)
    factor = float(np.trace(scaling[:3, :3])) - 2.0
    direction = real_eigenvector(scaling[:3, :3], factor, last=False)
    if direction is None:
        return (factor + 2.0) / 3.0, fixed_point(scaling), None
    return factor, fixed_point(scaling), unit_vector(direction)


def shear_matrix(angle: float, direction: ArrayLike, point: ArrayLike, normal: ArrayLike) -> Array:
    """Return the matrix that shears by `angle` along `direction` in the plane through `point`.

    `normal` is the normal vector of the plane. Raises ValueError if `direction` is not in the plane.
    """
    upright = unit_vector(first_three(normal))
    along = unit_vector(first_three(direction))
    if abs(upright @ along) > 1e-6:
        raise ValueError(
            f"direction must be orthogonal to normal, but their scalar product is {float(upright @ along)}"
        )
    slope = math.tan(angle)
    matrix = np.identity(4)
    matrix[:3, :3] += slope * np.outer(along, upright)
    matrix[:3, 3] = -slope * (first_three(point) @ upright) * along
    return matrix


def shear_from_matrix(matrix: ArrayLike) -> tuple[float, Array, Array, Array]:
    """Return the angle, the direction, a point on the plane (homogeneous, shape (4,)) and the plane's normal.

    Raises ValueError if `matrix` is not a shear.
    """
    shear = np.array(matrix, dtype=np.float64)
    linear = shear[:3, :3]
    values, vectors = np.linalg.eig(linear)
    kept = np.flatnonzero(np.abs(np.real(values) - 1.0) < 1e-4)
    if len(kept) < 2:
        raise ValueError(
            f"matrix must be a shear, with at least two eigenvalues 1; its eigenvalues are {values}"
        )
    # Fixed vectors span the plane. The most linearly independent pair gives the most accurate normal.
    plane = np.real(vectors[:, kept]).T
    pairs = [(plane[i], plane[j]) for i in range(len(plane)) for j in range(i)]
    across = max((np.cross(one, other) for one, other in pairs), key=lambda normal: float(normal @ normal))
    normal = across / math.sqrt(float(across @ across))
    moved = (linear - np.identity(3)) @ normal
    slope = math.sqrt(float(moved @ moved))
    return math.atan(slope), moved / slope, fixed_point(shear), normal
