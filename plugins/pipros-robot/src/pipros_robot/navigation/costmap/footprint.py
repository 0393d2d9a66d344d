"""The outline of a robot: read it from parameters, pad it, and place it at a pose."""

from __future__ import annotations

import ast
import math
from contextlib import suppress
from typing import Any

import numpy as np

from pipros.basics.syntax_trees import SYNTAX_TREES
from pipros_libraries.nodes.params import InvalidParameter, is_number
from pipros_robot.navigation.costmap.grid import Points

_CORNERS_OF_CIRCLE = 16
_MOST_CORNERS = 1000


def circle(radius: float) -> Points:
    """Return the outline of a round robot: a polygon with 16 corners, the first straight ahead."""
    angles = [2 * math.pi * at / _CORNERS_OF_CIRCLE for at in range(_CORNERS_OF_CIRCLE)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


def from_parameter(value: Any, name: str) -> Points:
    """Return the corners in a list of `[x, y]`, or in a string that contains such a list.

    Raises:
        InvalidParameter: the value has another form, fewer than 3 or more than 1000 corners, or a number
            that is not finite.
    """
    corners = value
    if isinstance(value, str):
        corners = None
        with SYNTAX_TREES, suppress(ValueError, SyntaxError, MemoryError, RecursionError):
            corners = ast.literal_eval(value.strip()) if len(value) < 60 * _MOST_CORNERS else None
    if (
        not isinstance(corners, list)
        or not 3 <= len(corners) <= _MOST_CORNERS
        or not all(isinstance(corner, list) and len(corner) == 2 for corner in corners)
        or not all(is_number(number) and math.isfinite(number) for corner in corners for number in corner)
    ):
        expected = f"a list of 3 to {_MOST_CORNERS} corners with finite numbers, such as [[1, 1], …]"
        raise InvalidParameter(f"{name} must be {expected}, got {str(value)[:200]}")
    # Genuine costmap_2d parses corners as single-precision floats; their cells depend on the rounding.
    with np.errstate(over="ignore"):
        single = [(float(np.float32(x)), float(np.float32(y))) for x, y in corners]
    if not np.isfinite(single).all():
        raise InvalidParameter(f"{name} must have coordinates below 3.4e38, got {str(value)[:200]}")
    return single


def as_text(corners: Points) -> str:
    """Format a footprint as costmap_2d does for the parameter server."""
    return "[" + ",".join(f"[{x:g},{y:g}]" for x, y in corners) + "]"


def padded(corners: Points, padding: float) -> Points:
    """Move each corner outwards by the padding in x and in y. A coordinate of 0 is not changed."""
    return [(float(x + np.sign(x) * padding), float(y + np.sign(y) * padding)) for x, y in corners]


def inscribed_radius(corners: Points) -> float:
    """Return the distance from the robot's centre to the outline; infinity with fewer than three corners."""
    if len(corners) <= 2:
        return math.inf
    starts = np.array(corners, float)
    edges = np.roll(starts, -1, axis=0) - starts
    lengths = (edges**2).sum(axis=1)
    along = np.clip(-(starts * edges).sum(axis=1) / np.where(lengths > 0, lengths, 1), 0, 1)
    nearest = starts + along[:, None] * edges
    return float(np.hypot(*nearest.T).min())


def placed(corners: Points, x: float, y: float, yaw: float) -> Points:
    """Return the corners of a robot's footprint at a pose."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return [(x + a * cosine - b * sine, y + a * sine + b * cosine) for a, b in corners]
