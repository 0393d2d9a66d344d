"""General functions for vectors and matrices: norms, unit vectors, products and eigenvectors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipros_libraries.transforms.rotations import EPSILON as EPSILON

Array = NDArray[np.float64]
"""Array of floats.

Its shape is (4, 4), (4,) or (3,), as described in the package's docstring, unless stated otherwise.
"""

EIGENVALUE_TOLERANCE = 1e-8


def vector_norm(data: ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """Return the Euclidean norm of `data`, or of its vectors along `axis`.

    The result is a float if `data` is one-dimensional, otherwise an array. If `out` is given, write the norms
    there and return None.
    """
    vectors = np.array(data, dtype=np.float64)
    if out is not None:
        np.sqrt((vectors**2).sum(axis=axis), out=out)
        return None
    if vectors.ndim == 1:
        return math.sqrt(vectors @ vectors)
    return np.sqrt(np.atleast_1d((vectors**2).sum(axis=axis)))


def unit_vector(data: ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """Return `data` divided by its norm, or with each vector along `axis` divided by its norm.

    If `out` is given, write the result there and return None. A vector of norm 0 gives NaN.
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
    """Return an array of shape `size` with uniformly distributed random numbers in [0, 1)."""
    return np.random.random(size)  # numpy.random.seed seeds this generator, as scripts expect


def identity_matrix() -> Array:
    """Return the 4x4 identity matrix."""
    return np.identity(4)


def inverse_matrix(matrix: ArrayLike) -> Array:
    """Return the inverse of a square matrix. Raises numpy.linalg.LinAlgError if it is singular."""
    return np.linalg.inv(np.asarray(matrix, dtype=np.float64))


def concatenate_matrices(*matrices: ArrayLike) -> Array:
    """Return the product of 4x4 matrices from left to right, or the identity if there are no arguments."""
    product = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, dtype=np.float64)
    return product


def is_same_transform(matrix0: ArrayLike, matrix1: ArrayLike) -> bool:
    """Return whether two 4x4 matrices represent the same transform, that is, are equal up to a factor."""
    first, second = np.array(matrix0, dtype=np.float64), np.array(matrix1, dtype=np.float64)
    return bool(np.allclose(first / first[3, 3], second / second[3, 3]))


def real_eigenvector(matrix: Array, eigenvalue: float, last: bool = True) -> Array | None:
    """Return the real part of an eigenvector for `eigenvalue`, or None if the matrix has no such eigenvalue.

    `matrix` has the shape (n, n), and the eigenvector (n,). If numpy finds several eigenvectors, return the
    last one, or the first one if `last` is false.
    """
    values, vectors = np.linalg.eig(matrix)
    found = np.flatnonzero(np.abs(np.real(values) - eigenvalue) < EIGENVALUE_TOLERANCE)
    if not len(found):
        return None
    vector: Array = np.real(vectors[:, found[-1 if last else 0]])
    return vector


def fixed_point(matrix: Array) -> Array:
    """Return a fixed point of a 4x4 transform, in homogeneous coordinates (shape (4,)).

    Raises ValueError if the transform has no fixed point.
    """
    point = real_eigenvector(matrix, 1.0)
    if point is None:
        raise ValueError("matrix must have a fixed point, but has no eigenvalue 1")
    point /= point[3]
    return point
