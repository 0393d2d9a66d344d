"""Remove lens distortion from points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pipros_libraries.vision.extras import numpy as np

COUNTS = (4, 5, 8, 12, 14)
"""Valid numbers of coefficients.

The plumb-bob model has 4 or 5. The rational polynomial model has 8, or 12 with thin-prism terms, or 14 with
thin-prism terms and a tilted sensor.
"""

_ITERATIONS = 5  # OpenCV's undistortPoints uses the same number of iterations


def undistorted(
    point: Sequence[float], camera: Any, coefficients: Sequence[float] | None, rotation: Any, projection: Any
) -> Any:
    """Convert the pixel (u, v) of the raw image to a rectified pixel, like OpenCV's `undistortPoints`.

    Args:
        camera: 3x3 camera matrix (K).
        coefficients: distortion coefficients, whose number is in `COUNTS`; None if there is no distortion.
        rotation: 3x3 rectification matrix (R).
        projection: 3x4 projection matrix of the rectified camera (P).

    Raises:
        ValueError: the number of coefficients is invalid.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        x = (point[0] - camera[0, 2]) / camera[0, 0]
        y = (point[1] - camera[1, 2]) / camera[1, 1]
        if coefficients is not None:
            x, y = _without_distortion(x, y, coefficients)
        moved = np.asarray(projection)[:3, :3] @ np.asarray(rotation) @ np.array([x, y, 1.0])
        return moved[:2] * (1.0 / moved[2])


def _without_distortion(x: float, y: float, coefficients: Sequence[float]) -> tuple[float, float]:
    """Undistort a point on the normalized image plane (depth 1) by fixed-point iteration."""
    if len(coefficients) not in COUNTS:
        raise ValueError(
            f"number of distortion coefficients must be {_listed(COUNTS)}, got {len(coefficients)}"
        )
    k = [float(value) for value in coefficients] + [0.0] * (max(COUNTS) - len(coefficients))
    start = x, y
    if k[12] or k[13]:
        x, y = _without_tilt(x, y, k[12], k[13])
    seen_x, seen_y = x, y
    for _ in range(_ITERATIONS):
        square = x * x + y * y
        radial = (1 + ((k[7] * square + k[6]) * square + k[5]) * square) / (
            1 + ((k[4] * square + k[1]) * square + k[0]) * square
        )
        if radial < 0:  # the model is not valid for this point
            return start
        offset_x = 2 * k[2] * x * y + k[3] * (square + 2 * x * x) + k[8] * square + k[9] * square * square
        offset_y = k[2] * (square + 2 * y * y) + 2 * k[3] * x * y + k[10] * square + k[11] * square * square
        x, y = (seen_x - offset_x) * radial, (seen_y - offset_y) * radial
    return x, y


def _without_tilt(x: float, y: float, about_x: float, about_y: float) -> tuple[float, float]:
    """Undo the sensor's tilt about its axes. The angles are in radians."""
    sin_x, cos_x, sin_y, cos_y = np.sin(about_x), np.cos(about_x), np.sin(about_y), np.cos(about_y)
    turn = np.array([[cos_y, 0, -sin_y], [0, 1, 0], [sin_y, 0, cos_y]]) @ np.array(
        [[1, 0, 0], [0, cos_x, sin_x], [0, -sin_x, cos_x]]
    )
    onto_sensor = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    back = np.linalg.solve(onto_sensor @ turn, np.array([x, y, 1.0]))
    return back[0] / back[2], back[1] / back[2]


def _listed(counts: Sequence[int]) -> str:
    return f"{', '.join(map(str, counts[:-1]))} or {counts[-1]}"
