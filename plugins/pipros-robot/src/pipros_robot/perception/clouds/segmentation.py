"""Plane fitting by RANSAC, and Euclidean clustering, as in PCL."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.extras import scipy_part, tree_of

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

PAIRS: Final = 10_000_000
"""Default maximum number of neighbour pairs in memory."""


def plane(
    points: Array,
    threshold: float,
    iterations: int = 50,
    probability: float = 0.99,
    optimize: bool = True,
    has_ended: Callable[[], bool] = bool,
) -> tuple[Array, Array] | None:
    """Return the coefficients (a, b, c, d) of the plane with the most inliers, and the inliers' indices.

    The normal (a, b, c) has length 1. The search tries random planes, but is reproducible: equal points give
    equal results. Return None if no plane is found.

    Args:
        points: an array of shape (n, 3); points that are not finite are ignored.
        threshold: maximum distance of an inlier from the plane.
        iterations: maximum number of planes to try.
        probability: the search ends when, with this probability, at least one of the tried planes was defined
            by inliers only.
        optimize: whether to fit the plane to its inliers.
        has_ended: called between planes; if it returns True, the best plane so far is returned.
    """
    finite = np.flatnonzero(np.isfinite(points).all(1))
    found = points[finite].astype(np.float64)
    if len(found) < 3:
        return None
    numbers = np.random.default_rng(12345)
    best, most, needed = None, 0, float(iterations)
    for tried in range(iterations):
        if tried >= needed or has_ended():
            break
        a, b, c = found[numbers.choice(len(found), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = float(np.sqrt(normal @ normal))
        if length < 1e-12:
            continue
        normal = normal / length
        count = int(np.count_nonzero(np.abs(found @ normal - a @ normal) <= threshold))
        if count > most:
            best, most = np.append(normal, -(a @ normal)), count
            needed = _tries(count / len(found), probability)
    if best is None:
        return None
    inliers = _inliers(found, best, threshold)
    if optimize and len(inliers) > 3:
        best = _fitted(found[inliers], best)
        inliers = _inliers(found, best, threshold)
    return best, finite[inliers]


def _tries(share: float, probability: float) -> float:
    """Return the number of tries needed to define at least one plane by three inliers.

    `share` is the proportion of inliers among the points, and `probability` the probability of success.
    """
    chance = share**3
    return 1.0 if chance >= 1.0 else math.log(1.0 - probability) / math.log1p(-max(chance, 1e-300))


def _inliers(points: Array, coefficients: Array, threshold: float) -> Array:
    return np.flatnonzero(np.abs(points @ coefficients[:3] + coefficients[3]) <= threshold)


def _fitted(points: Array, before: Array) -> Array:
    """Return the least-squares plane. Its normal points to the same side as that of the plane `before`."""
    center = points.mean(0)
    normal = np.linalg.eigh(np.cov((points - center).T))[1][:, 0]
    normal = normal if normal @ before[:3] >= 0 else -normal
    return np.append(normal, -(normal @ center))


def clusters(points: Array, tolerance: float, smallest: int, largest: int, pairs: int = PAIRS) -> list[Any]:
    """Return the sorted indices of each cluster, the largest cluster first.

    Two points are in the same cluster if a chain of points connects them in steps of at most `tolerance`.
    Points with NaN or infinite coordinates are ignored. Computing time grows with the number of pairs of
    neighbours at different positions; memory is limited by `pairs`.

    Args:
        smallest, largest: limits of a cluster's size; other clusters are omitted.
        pairs: maximum number of neighbour pairs in memory, unless a single point has more neighbours.
    """
    finite = np.flatnonzero(np.isfinite(points).all(1))
    if not len(finite):
        return []
    places, place_of = _places(points[finite])
    labels = _labels(places.astype(np.float64), tolerance, pairs)[place_of]
    order = np.argsort(labels, kind="stable")
    groups = np.split(finite[order], np.flatnonzero(np.diff(labels[order])) + 1)
    return sorted((each for each in groups if smallest <= len(each) <= largest), key=lambda each: -len(each))


def _places(points: Array) -> tuple[Array, Array]:
    """Return the distinct positions, and the index of each point's position.

    Duplicates are common, because many drivers place points without a measurement at the origin.
    """
    order = np.lexsort(points.T)
    ordered = points[order]
    is_first = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(1)])
    place_of = np.empty(len(points), np.int64)
    place_of[order] = np.cumsum(is_first) - 1
    return ordered[is_first], place_of


def _labels(points: Array, tolerance: float, pairs: int) -> Array:
    tree = tree_of(points, "pcl/EuclideanClusterExtraction")
    coo_matrix = scipy_part("sparse", "pcl/EuclideanClusterExtraction").coo_matrix
    connected_components = scipy_part("sparse.csgraph", "pcl/EuclideanClusterExtraction").connected_components
    count = len(points)
    total = np.cumsum(tree.query_ball_point(points, tolerance, return_length=True))
    labels, start = np.arange(count), 0
    while start < count:
        before = total[start - 1] if start else 0
        end = max(int(np.searchsorted(total, before + pairs)), start + 1)
        part = tree_of(points[start:end], "pcl/EuclideanClusterExtraction")
        near = part.sparse_distance_matrix(tree, tolerance, output_type="coo_matrix")
        # To keep the groups found so far, connect each point to the first point of its group.
        firsts = np.unique(labels, return_index=True)[1][labels]
        rows = np.concatenate([near.row + start, np.arange(count)])
        columns = np.concatenate([near.col, firsts])
        graph = coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape=(count, count))
        labels = connected_components(graph, directed=False)[1]
        start = end
    return labels
