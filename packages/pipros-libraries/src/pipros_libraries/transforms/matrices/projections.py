"""Projections onto a plane, and view-volume (clip) matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms.matrices.affine import first_three
from pipros_libraries.transforms.matrices.arrays import (
    EIGENVALUE_TOLERANCE,
    EPSILON,
    Array,
    real_eigenvector,
    unit_vector,
)

Projection = tuple[Array, Array | None, Array | None, Array | None, bool]


def projection_matrix(
    point: ArrayLike,
    normal: ArrayLike,
    direction: ArrayLike | None = None,
    perspective: ArrayLike | None = None,
    pseudo: bool = False,
) -> Array:
    """Return the matrix that projects onto the plane through `point` with the normal vector `normal`.

    Args:
        direction: project along this vector instead of the normal.
        perspective: project from this point; `direction` is then ignored.
        pseudo: preserve relative depth in a perspective projection.
    """
    on_plane, upright = first_three(point), unit_vector(first_three(normal))
    matrix = np.identity(4)
    if perspective is not None:
        eye = first_three(perspective)
        distance = (eye - on_plane) @ upright
        matrix[:3, :3] = distance * np.identity(3) - np.outer(eye, upright)
        height = on_plane @ upright
        if pseudo:
            matrix[:3, :3] -= np.outer(upright, upright)
            matrix[:3, 3] = height * (eye + upright)
        else:
            matrix[:3, 3] = height * eye
        matrix[3, :3] = -upright
        matrix[3, 3] = eye @ upright
        return matrix
    along = upright if direction is None else first_three(direction)
    matrix[:3, :3] -= np.outer(along, upright) / (along @ upright)
    matrix[:3, 3] = along * ((on_plane @ upright) / (along @ upright))
    return matrix


def projection_from_matrix(matrix: ArrayLike, pseudo: bool = False) -> Projection:
    """Recover the arguments of `projection_matrix`: point, normal, direction, perspective and pseudo.

    The point is in homogeneous coordinates (shape (4,)). Raises ValueError if `matrix` is not a projection.
    """
    projection = np.array(matrix, dtype=np.float64)
    linear = projection[:3, :3]
    kept = real_eigenvector(projection, 1.0)
    if not pseudo and kept is not None:
        along = real_eigenvector(linear, 0.0, last=False)
        if along is None:
            raise ValueError("matrix must be a projection, but has no eigenvalue 0")
        along = along / np.sqrt(along @ along)
        normal = real_eigenvector(linear.T, 0.0, last=False)
        # If the transpose has no such eigenvector, the normal is unknown: return the direction in its place.
        if normal is None:
            return kept / kept[3], along, None, None, False
        return kept / kept[3], normal / np.sqrt(normal @ normal), along, None, False
    values, vectors = np.linalg.eig(projection)
    other = np.flatnonzero(np.abs(np.real(values)) > EIGENVALUE_TOLERANCE)
    if not len(other):
        raise ValueError("matrix must be a projection, but all its eigenvalues are 0")
    point: Array = np.real(vectors[:, other[-1]])
    point = point / point[3]
    normal = -projection[3, :3]
    eye = projection[:3, 3] / (point[:3] @ normal)
    if pseudo:
        eye = eye - normal
    return point, normal, None, eye, pseudo


def clip_matrix(
    left: float, right: float, bottom: float, top: float, near: float, far: float, perspective: bool = False
) -> Array:
    """Return the matrix that maps a camera's view volume to the cube from -1 to 1.

    The first six arguments bound the view volume along x, y and z. The volume is a box, or, if `perspective`
    is true, a frustum with its apex at the origin, cut off at `near`. Points mapped with perspective must be
    divided by their fourth coordinate. Raises ValueError if a lower bound is not below the upper bound, or if
    `perspective` is true and `near` is not greater than 0.
    """
    if left >= right or bottom >= top or near >= far:
        raise ValueError(
            "left must be < right, bottom < top and near < far, "
            f"got {(left, right)}, {(bottom, top)}, {(near, far)}"
        )
    width, height, depth = right - left, top - bottom, far - near
    if not perspective:
        return np.array(
            (
                (2.0 / width, 0.0, 0.0, -(right + left) / width),
                (0.0, 2.0 / height, 0.0, -(top + bottom) / height),
                (0.0, 0.0, 2.0 / depth, -(far + near) / depth),
                (0.0, 0.0, 0.0, 1.0),
            )
        )
    if near <= EPSILON:
        raise ValueError(f"near must be > 0 for a perspective view, got {near}")
    return np.array(
        (
            (-2.0 * near / width, 0.0, (right + left) / width, 0.0),
            (0.0, -2.0 * near / height, (top + bottom) / height, 0.0),
            (0.0, 0.0, -(far + near) / depth, 2.0 * near * far / depth),
            (0.0, 0.0, -1.0, 0.0),
        )
    )
