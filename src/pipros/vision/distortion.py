"""Removes the distortion of lenses from points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pipros.vision.extras import numpy as np

COUNTS = (4, 5, 8, 12, 14)
"""The allowed numbers of coefficients: plumb bob has 5, rational polynomial 8; then thin prisms and a
tilt."""

_ROUNDS = 5  # the number of iterations of OpenCV's undistortPoints


def undistorted(
    point: Sequence[float], camera: Any, coefficients: Sequence[float] | None, rotation: Any, projection: Any
) -> Any:
    """The place of a pixel (u, v) of a raw image in the rectified one, like OpenCV's `undistortPoints`.

    Args:
        camera: the 3x3 matrix of the camera (K).
        coefficients: of the distortion, as many as `COUNTS` allows; None for a lens without distortion.
        rotation: the 3x3 matrix of the rectification (R).
        projection: the 3x4 matrix of the rectified camera (P).

    Raises:
        ValueError: the number of coefficients is not allowed.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        x = (point[0] - camera[0, 2]) / camera[0, 0]
        y = (point[1] - camera[1, 2]) / camera[1, 1]
        if coefficients is not None:
            x, y = _without_distortion(x, y, coefficients)
        moved = np.asarray(projection)[:3, :3] @ np.asarray(rotation) @ np.array([x, y, 1.0])
        return moved[:2] * (1.0 / moved[2])


def _without_distortion(x: float, y: float, coefficients: Sequence[float]) -> tuple[float, float]:
    """The point on the plane at distance 1 that the lens shows at (x, y), by fixed-point iteration."""
    if len(coefficients) not in COUNTS:
        raise ValueError(f"a distortion must have {_listed(COUNTS)} coefficients, got {len(coefficients)}")
    k = [float(value) for value in coefficients] + [0.0] * (max(COUNTS) - len(coefficients))
    start = x, y
    if k[12] or k[13]:
        x, y = _without_tilt(x, y, k[12], k[13])
    seen_x, seen_y = x, y
    for _ in range(_ROUNDS):
        square = x * x + y * y
        shrink = (1 + ((k[7] * square + k[6]) * square + k[5]) * square) / (
            1 + ((k[4] * square + k[1]) * square + k[0]) * square
        )
        if shrink < 0:  # outside of the range of the model
            return start
        aside_x = 2 * k[2] * x * y + k[3] * (square + 2 * x * x) + k[8] * square + k[9] * square * square
        aside_y = k[2] * (square + 2 * y * y) + 2 * k[3] * x * y + k[10] * square + k[11] * square * square
        x, y = (seen_x - aside_x) * shrink, (seen_y - aside_y) * shrink
    return x, y


def _without_tilt(x: float, y: float, about_x: float, about_y: float) -> tuple[float, float]:
    """The point before the sensor was tilted about its axes, by angles in radians."""
    sin_x, cos_x, sin_y, cos_y = np.sin(about_x), np.cos(about_x), np.sin(about_y), np.cos(about_y)
    turn = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]]) @ np.array(
        [[1, 0, 0], [0, cos_x, sin_x], [0, -sin_x, cos_x]]
    )
    onto_sensor = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    back = np.linalg.solve(onto_sensor @ turn, np.array([x, y, 1.0]))
    return back[0] / back[2], back[1] / back[2]


def _listed(counts: Sequence[int]) -> str:
    return f"{', '.join(map(str, counts[:-1]))} or {counts[-1]}"
