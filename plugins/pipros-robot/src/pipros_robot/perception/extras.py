"""Import numpy and scipy; if one is not installed, raise an error that names the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.extras import missing

try:
    import numpy as numpy
except ImportError as error:
    raise missing("point clouds and laser scans need numpy", "perception", error) from error


def tree_of(points: Any, purpose: str) -> Any:
    """Return scipy's k-d tree for points, an array of shape (n, 3) of finite numbers.

    Raises:
        MissingExtra: scipy is not installed. The message names `purpose`.
    """
    try:
        from scipy.spatial import cKDTree
    except ImportError as error:
        raise missing(f"{purpose} needs scipy", "perception", error) from error
    return cKDTree(points)
