"""Import numpy and scipy; if one is not installed, raise an error that names the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.extras import missing, required

try:
    import numpy as numpy
except ImportError as error:
    raise missing("point clouds and laser scans need numpy", "pipros-robot", error) from error


def tree_of(points: Any, purpose: str) -> Any:
    """Return scipy's k-d tree for points, an array of shape (n, 3) of finite numbers.

    Raises:
        MissingExtra: scipy is not installed. The message names `purpose`.
    """
    return scipy_part("spatial", purpose).cKDTree(points)


def scipy_part(name: str, purpose: str) -> Any:
    """Return a module of scipy, such as `spatial`. Without scipy, raise MissingExtra that names `purpose`."""
    return required(f"scipy.{name}", f"{purpose} needs scipy", "pipros-robot")
