"""Compose matrices from scale, shear, rotation, translation and perspective, and decompose them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pipros_libraries.transforms.matrices.affine import translation_matrix
from pipros_libraries.transforms.matrices.arrays import EPSILON, Array
from pipros_libraries.transforms.matrices.euler import euler_matrix
from pipros_libraries.transforms.matrices.quaternions import quaternion_matrix

Parts = tuple[Array, list[float], list[float], Array, Array]
"""Scale, shear, angles and translation with three numbers each, and perspective of shape (4,)."""


def decompose_matrix(matrix: ArrayLike) -> Parts:
    """Decompose a matrix into scale, shear, angles, translation and perspective.

    Scale and translation are (x, y, z), shear is (x-y, x-z, y-z), and angles are about the static axes x, y
    and z. `compose_matrix` is the inverse. Method: S. W. Thomas, "Decomposing a matrix into simple
    transformations", Graphics Gems II. Raises ValueError if the matrix cannot be decomposed.
    """
    whole = np.array(matrix, dtype=np.float64)
    if abs(whole[3, 3]) < EPSILON:
        raise ValueError(f"matrix[3, 3] must not be 0, got {whole[3, 3]}")
    whole /= whole[3, 3]
    affine = whole.copy()
    affine[3] = (0.0, 0.0, 0.0, 1.0)
    if not np.linalg.det(affine):
        raise ValueError("matrix must be invertible, but its determinant is 0")
    perspective = np.array((0.0, 0.0, 0.0, 1.0))
    if np.any(np.abs(whole[3, :3]) > EPSILON):
        perspective = whole[3] @ np.linalg.inv(affine)

    # Apply Gram-Schmidt to the columns. The removed parts give the shear, and the remaining lengths give the
    # scale.
    x, y, z = (affine[:3, column].copy() for column in range(3))
    scale_x = math.sqrt(x @ x)
    x /= scale_x
    shear_xy = float(x @ y)
    y -= x * shear_xy
    scale_y = math.sqrt(y @ y)
    y /= scale_y
    shear_xz = float(x @ z)
    z -= x * shear_xz
    shear_yz = float(y @ z)
    z -= y * shear_yz
    scale_z = math.sqrt(z @ z)
    z /= scale_z
    scale = np.array((scale_x, scale_y, scale_z))
    shear = [shear_xy / scale_y, shear_xz / scale_z, shear_yz / scale_z]
    if x @ np.cross(y, z) < 0.0:
        scale, x, y, z = -scale, -x, -y, -z

    angle_y = math.asin(max(-1.0, min(1.0, -x[2])))
    if math.cos(angle_y):
        angles = [math.atan2(y[2], z[2]), angle_y, math.atan2(x[1], x[0])]
    else:
        angles = [math.atan2(-z[1], y[1]), angle_y, 0.0]
    return scale, shear, angles, affine[:3, 3].copy(), perspective


def compose_matrix(
    scale: Sequence[float] | Array | None = None,
    shear: Sequence[float] | Array | None = None,
    angles: Sequence[float] | Array | None = None,
    translate: ArrayLike | None = None,
    perspective: ArrayLike | None = None,
) -> Array:
    """Return the matrix that scales, shears, rotates, translates and projects, in that order.

    A step is omitted if its argument is None. The arguments have the format that `decompose_matrix` returns.
    """
    matrix = np.identity(4)
    if perspective is not None:
        matrix[3, :] = np.asarray(perspective, dtype=np.float64)[:4]
    if translate is not None:
        matrix = matrix @ translation_matrix(translate)
    if angles is not None:
        matrix = matrix @ euler_matrix(angles[0], angles[1], angles[2], "sxyz")
    if shear is not None:
        shearing = np.identity(4)
        shearing[0, 1], shearing[0, 2], shearing[1, 2] = shear[0], shear[1], shear[2]
        matrix = matrix @ shearing
    if scale is not None:
        matrix = matrix @ np.diag((scale[0], scale[1], scale[2], 1.0))
    result: Array = matrix / matrix[3, 3]
    return result


def orthogonalization_matrix(lengths: ArrayLike, angles: ArrayLike) -> Array:
    """Return the matrix that converts crystallographic to Cartesian coordinates.

    Args:
        lengths: edge lengths (a, b, c) of the unit cell.
        angles: angles (alpha, beta, gamma) of the unit cell in degrees.
    """
    a, b, c = np.asarray(lengths, dtype=np.float64).tolist()
    alpha, beta, gamma = np.radians(np.asarray(angles, dtype=np.float64)).tolist()
    sine_a, sine_b = math.sin(alpha), math.sin(beta)
    cosine_a, cosine_b = math.cos(alpha), math.cos(beta)
    ratio = (cosine_a * cosine_b - math.cos(gamma)) / (sine_a * sine_b)
    return np.array(
        (
            (a * sine_b * math.sqrt(1.0 - ratio * ratio), 0.0, 0.0, 0.0),
            (-a * sine_b * ratio, b * sine_a, 0.0, 0.0),
            (a * cosine_b, b * cosine_a, c, 0.0),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def superimposition_matrix(v0: ArrayLike, v1: ArrayLike, scaling: bool = False, usesvd: bool = True) -> Array:
    """Return the rigid transform (or similarity, if `scaling` is true) that maps `v0` closest to `v1`.

    Both arguments are arrays of shape (3, n) or (4, n), n >= 3, with one point per column. The transform
    minimizes the sum of squared distances. Methods: W. Kabsch (1976) with singular values; B. K. P. Horn
    (1987) with quaternions if `usesvd` is False. Raises ValueError if the shapes differ or n < 3.
    """
    source = np.array(v0, dtype=np.float64)[:3]
    target = np.array(v1, dtype=np.float64)[:3]
    if source.shape != target.shape or source.shape[1] < 3:
        raise ValueError(
            "v0 and v1 must have the same shape, with at least 3 columns, "
            f"got {source.shape} and {target.shape}"
        )
    source_centre, target_centre = source.mean(axis=1), target.mean(axis=1)
    source -= source_centre[:, None]
    target -= target_centre[:, None]
    matrix = np.identity(4)
    matrix[:3, :3] = _kabsch(source, target) if usesvd else _horn(source, target)
    if scaling:
        matrix[:3, :3] *= math.sqrt(float((target**2).sum()) / float((source**2).sum()))
    matrix[:3, 3] = target_centre - matrix[:3, :3] @ source_centre
    return matrix


def _kabsch(source: Array, target: Array) -> Array:
    """Return the rotation (3, 3) that minimizes the sum of squared distances between points.

    Both arguments have the shape (3, n), with one point per column.
    """
    left, _, right = np.linalg.svd(target @ source.T)
    rotation: Array = left @ right
    # a reflection would fit best, so flip the axis with the smallest singular value
    if np.linalg.det(rotation) < 0.0:
        rotation = rotation - 2.0 * np.outer(left[:, 2], right[2, :])
    return rotation


def _horn(source: Array, target: Array) -> Array:
    """Like `_kabsch`, but use quaternions."""
    s = source @ target.T
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = s.tolist()
    symmetric = np.array(
        (
            (xx + yy + zz, yz - zy, zx - xz, xy - yx),
            (yz - zy, xx - yy - zz, xy + yx, zx + xz),
            (zx - xz, xy + yx, yy - xx - zz, yz + zy),
            (xy - yx, zx + xz, yz + zy, zz - xx - yy),
        )
    )
    _, vectors = np.linalg.eigh(symmetric)
    qw, qx, qy, qz = vectors[:, -1].tolist()  # the eigenvector for the largest eigenvalue
    return quaternion_matrix((qx, qy, qz, qw))[:3, :3]
