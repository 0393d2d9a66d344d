"""Align a scan with a reference scan by iterated least squares, and follow a robot from scan to scan.

Each point of the scan is compared with the line through the nearest reference points, so offsets along a wall
are ignored (A. Censi, An ICP Variant Using a Point-to-Line Metric, IEEE International Conference on Robotics
and Automation, 2008). Points are complex numbers x + iy in the robot's frame, in metres.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.mapping.matching import Places, wall_normals
from pipros_robot.navigation.plane import Triple

Array = NDArray[np.float64]

_DAMPING: Final = 0.1
"""Damping of the least squares, which keeps the pose in directions that walls do not constrain."""
_LEAST_POINTS: Final = 10
"""Minimum number of points that match."""


@dataclass(frozen=True, slots=True)
class IcpSettings:
    """The parameters of the matching by their ROS names, and the distances between keyframes."""

    max_angular_correction_deg: float = 45.0
    max_linear_correction: float = 0.5
    max_iterations: int = 10
    epsilon_xy: float = 1e-6
    epsilon_theta: float = 1e-6
    max_correspondence_dist: float = 0.3
    sigma: float = 0.01
    use_point_to_line_distance: int = 1
    outliers_maxPerc: float = 0.9  # noqa: N815 (the name of the parameter)
    outliers_adaptive_order: float = 0.7
    outliers_adaptive_mult: float = 2.0
    do_compute_covariance: int = 0
    kf_dist_linear: float = 0.1
    kf_dist_angular: float = 10.0 * (math.pi / 180.0)


@dataclass(frozen=True, slots=True)
class Match:
    """A pose relative to the reference scan, and the covariance of x, y and yaw, shape (3, 3)."""

    pose: Triple
    covariance: Array


def composed(outer: Triple, inner: Triple) -> Triple:
    """Return the pose `inner`, which is relative to `outer`, in the frame of `outer`."""
    place = complex(*outer[:2]) + complex(*inner[:2]) * cmath.exp(1j * outer[2])
    return place.real, place.imag, math.remainder(outer[2] + inner[2], math.tau)


def between(old: Triple, new: Triple) -> Triple:
    """Return the pose `new` relative to the pose `old`."""
    moved = complex(new[0] - old[0], new[1] - old[1]) * cmath.exp(-1j * old[2])
    return moved.real, moved.imag, math.remainder(new[2] - old[2], math.tau)


def aligned(settings: IcpSettings, reference: Places, points: Places, guess: Triple) -> Match | None:
    """Return the pose at which `points` fit `reference`, or None if no pose near the guess does.

    The points of both scans are in the order of their beams.
    """
    pose, normals = guess, wall_normals(reference)
    for _ in range(max(1, settings.max_iterations)):
        x, y, yaw = pose
        turned = points * cmath.exp(1j * yaw)
        nearest, squares = _nearest(reference, turned + complex(x, y))
        chosen = _inliers(settings, squares)
        if settings.use_point_to_line_distance:
            chosen &= normals[nearest] != 0
        if np.count_nonzero(chosen) < _LEAST_POINTS:
            return None
        gaps = reference[nearest[chosen]] - turned[chosen] - complex(x, y)
        by_turn = 1j * turned[chosen]
        lines = [normals[nearest[chosen]]]
        if not settings.use_point_to_line_distance:
            lines = [np.ones(len(gaps), complex), np.full(len(gaps), 1j)]
        slopes = np.concatenate(
            [np.column_stack((each.real, each.imag, (each.conj() * by_turn).real)) for each in lines]
        )
        offsets = np.concatenate([(each.conj() * gaps).real for each in lines])
        matrix = slopes.T @ slopes + _DAMPING * np.eye(3)
        step = np.linalg.solve(matrix, slopes.T @ offsets)
        pose = x + float(step[0]), y + float(step[1]), yaw + float(step[2])
        if math.hypot(step[0], step[1]) < settings.epsilon_xy and abs(step[2]) < settings.epsilon_theta:
            break
    turn = abs(math.remainder(pose[2] - guess[2], math.tau))
    is_far = math.dist(pose[:2], guess[:2]) > settings.max_linear_correction
    if is_far or turn > math.radians(settings.max_angular_correction_deg):
        return None
    return Match(pose, settings.sigma**2 * np.linalg.inv(matrix))


def _nearest(reference: Places, points: Places) -> tuple[NDArray[np.int64], Array]:
    """Return the index of the nearest reference point for each point, and the squared distance."""
    across = points.real[:, None] - reference.real
    up = points.imag[:, None] - reference.imag
    squares = across * across + up * up
    nearest = squares.argmin(axis=1)
    return nearest, squares[np.arange(len(points)), nearest]


def _inliers(settings: IcpSettings, squares: Array) -> NDArray[np.bool_]:
    """Return which points count: those near a reference point, without the share that fits worst."""
    distances = np.sqrt(squares)
    near = distances[distances <= settings.max_correspondence_dist]
    if not len(near):
        return np.zeros(len(squares), bool)
    limit = min(
        float(np.quantile(near, min(1.0, settings.outliers_maxPerc))),
        settings.outliers_adaptive_mult
        * float(np.quantile(near, min(1.0, settings.outliers_adaptive_order))),
    )
    chosen: NDArray[np.bool_] = distances <= max(limit, 1e-6)
    return chosen


class ScanTracker:
    """The pose of a robot in the frame of its first scan. Not thread-safe.

    Attributes:
        pose: the pose.
        covariance: the covariance of the last match, shape (3, 3).
    """

    def __init__(self, settings: IcpSettings) -> None:
        self._settings = settings
        self._reference: Places | None = None
        self._keyframe: Triple = (0.0, 0.0, 0.0)
        self.pose: Triple = (0.0, 0.0, 0.0)
        self.covariance: Array = np.zeros((3, 3))

    def track(self, points: Places, moved: Triple) -> bool:
        """Match a scan. Return False if it does not match; the pose is then the expected one.

        Args:
            moved: the expected pose relative to the pose at the last scan.
        """
        settings = self._settings
        if self._reference is None:
            self._reference = points
            return True
        guess = between(self._keyframe, composed(self.pose, moved))
        match = aligned(settings, self._reference, points, guess)
        if match is None:
            self.pose = composed(self.pose, moved)
            self._reference, self._keyframe = points, self.pose
            return False
        x, y, yaw = match.pose
        self.pose, self.covariance = composed(self._keyframe, match.pose), match.covariance
        turn = abs(math.remainder(yaw, math.tau))
        if math.hypot(x, y) > settings.kf_dist_linear or turn > settings.kf_dist_angular:
            self._reference, self._keyframe = points, self.pose
        return True
