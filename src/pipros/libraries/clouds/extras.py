"""Import numpy and scipy, with an error message that names the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command

try:
    import numpy as numpy
except ImportError as error:
    raise MissingExtra(
        f"point clouds and laser scans need numpy, which is not installed. "
        f"Try: {install_command('perception')}",
        name=error.name,
    ) from error


def tree_of(points: Any, purpose: str) -> Any:
    """Return a k-d tree of scipy for points, an array of shape (n, 3) of finite numbers.

    Raises:
        MissingExtra: scipy is not installed. The message names `purpose`.
    """
    try:
        from scipy.spatial import cKDTree
    except ImportError as error:
        raise MissingExtra(
            f"{purpose} needs scipy, which is not installed. Try: {install_command('perception')}",
            name=error.name,
        ) from error
    return cKDTree(points)
