"""Vectors and matrices in general: norms, unit vectors, products, eigenvectors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

EPSILON = float(np.finfo(float).eps) * 4.0
"""Below this a number counts as zero; what tf calls `_EPS`."""

EIGENVALUE_TOLERANCE = 1e-8


def vector_norm(data: ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """The Euclidean length of `data`, or of its vectors along `axis`.

    Returns a number for a flat vector, otherwise an array. With `out` the lengths are written there and None
    is returned.
    """
    vectors = np.array(data, dtype=np.float64)
    if out is not None:
        np.sqrt((vectors**2).sum(axis=axis), out=out)
        return None
    if vectors.ndim == 1:
        return math.sqrt(vectors @ vectors)
    return np.sqrt(np.atleast_1d((vectors**2).sum(axis=axis)))


def unit_vector(data: ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """`data` divided by its length, or its vectors along `axis` each by their own.

    With `out` the result is written there and None is returned. A vector of length zero gives NaN.
    """
    if out is None:
        vectors = np.array(data, dtype=np.float64)
    else:
        vectors = out
        if out is not data:
            vectors[...] = np.asarray(data, dtype=np.float64)
    vectors /= np.sqrt((vectors**2).sum(axis=axis, keepdims=axis is not None))
    return vectors if out is None else None


def random_vector(size: int | tuple[int, ...]) -> Array:
    """Random numbers between 0 (included) and 1 (excluded), in the shape `size`."""
    return np.random.random(size)  # seeded by numpy.random.seed, as scripts expect


def identity_matrix() -> Array:
    """The transform that leaves everything where it is."""
    return np.identity(4)


def inverse_matrix(matrix: ArrayLike) -> Array:
    """The inverse of a square matrix. Raises numpy.linalg.LinAlgError if it has none."""
    return np.linalg.inv(np.asarray(matrix, dtype=np.float64))


def concatenate_matrices(*matrices: ArrayLike) -> Array:
    """The product of the matrices from left to right; the identity where there are none."""
    product = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, dtype=np.float64)
    return product


def is_same_transform(matrix0: ArrayLike, matrix1: ArrayLike) -> bool:
    """Whether both matrices move points alike: they may differ by a factor."""
    first, second = np.array(matrix0, dtype=np.float64), np.array(matrix1, dtype=np.float64)
    return bool(np.allclose(first / first[3, 3], second / second[3, 3]))


def real_eigenvector(matrix: Array, eigenvalue: float, last: bool = True) -> Array | None:
    """The real part of an eigenvector for the eigenvalue, or None if the matrix has no such eigenvalue.

    Where there are several, numpy's last or first one.
    """
    values, vectors = np.linalg.eig(matrix)
    found = np.flatnonzero(np.abs(np.real(values) - eigenvalue) < EIGENVALUE_TOLERANCE)
    if not len(found):
        return None
    vector: Array = np.real(vectors[:, found[-1 if last else 0]])
    return vector


def fixed_point(matrix: Array) -> Array:
    """A point, as four homogeneous coordinates, that the transform leaves in place.

    Raises ValueError if there is none.
    """
    point = real_eigenvector(matrix, 1.0)
    if point is None:
        raise ValueError("the matrix must leave a point in place, but has no eigenvalue 1")
    point /= point[3]
    return point
