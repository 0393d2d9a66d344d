"""The estimated state of a robot, measurements of some of its variables, and its motion model.

The state has 15 variables: position and roll, pitch, yaw in the world frame (m, rad), then linear and angular
velocity in the robot's frame (m/s, rad/s), then linear acceleration in the robot's frame (m/s²). Angles are
rotations about the fixed axes x, y and z, in that order.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, pi, sin
from typing import Any, Final

import numpy as np

from pipros.basics.errors import PiprosError
from pipros_libraries.transforms.pose import from_roll_pitch_yaw, rotation_matrix
from pipros_robot.navigation.plane import MOST

Array = np.ndarray[Any, np.dtype[np.float64]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]

SIZE: Final = 15
POSITION: Final = slice(0, 3)
ANGLES: Final = slice(3, 6)
POSE: Final = slice(0, 6)
VELOCITY: Final = slice(6, 9)
RATES: Final = slice(9, 12)
TWIST: Final = slice(6, 12)
ACCELERATION: Final = slice(12, 15)

OUT_OF_PLANE: Final = np.array([2, 3, 4, 8, 9, 10, 14])
"""The variables that are 0 for a robot in the plane: z, roll, pitch, their velocities, and z acceleration."""

_LEAST_VARIANCE: Final = 1e-9


class UnusableMeasurement(PiprosError):
    """A measurement must not be used, because it would spoil the estimate. The text names the reason."""


@dataclass(frozen=True, slots=True, eq=False)
class VelocityCommand:
    """A commanded velocity: vx, vy, vz, vroll, vpitch, vyaw in the robot's frame, and its time in seconds."""

    velocity: Array
    time_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Measured values of some of the state's variables.

    Attributes:
        source: the input that provided the measurement, such as `odom0_pose`.
        time_s: seconds since the epoch.
        values, covariance: values and covariance of all 15 variables. Variables without a flag are ignored.
        flags: the measured variables.
        threshold: Mahalanobis distance at which the measurement is rejected.
        command: the newest command when the measurement arrived; set by `Timeline.add`.
    """

    source: str
    time_s: float
    values: Array
    covariance: Array
    flags: Flags
    threshold: float = inf
    command: VelocityCommand | None = None

    def usable(self) -> np.ndarray[Any, np.dtype[np.intp]]:
        """Return the indices of the measured variables with finite values."""
        return np.flatnonzero(self.flags & np.isfinite(self.values))

    def check(self) -> None:
        """Raise `UnusableMeasurement` if a usable variable has a huge value, or a huge covariance."""
        indices = self.usable()
        if not np.all(np.abs(self.values[indices]) <= MOST):
            raise UnusableMeasurement(f"values must be at most {MOST:g}")
        if not np.all(np.abs(self.covariance[np.ix_(indices, indices)]) <= MOST**2):
            raise UnusableMeasurement(f"covariances must be finite, and at most {MOST**2:g}")

    def noise(self, indices: np.ndarray[Any, np.dtype[np.intp]]) -> Array:
        """Return the covariance of the given variables, with variances of at least 1e-9."""
        noise: Array = self.covariance[np.ix_(indices, indices)]
        variances = np.maximum(np.abs(noise.diagonal()), _LEAST_VARIANCE)
        noise[np.diag_indices_from(noise)] = variances
        return noise


def wrapped(angles: Array) -> Array:
    """Wrap angles to the range from -pi to pi."""
    return np.asarray(np.where(np.abs(angles) > pi, angles - 2 * pi * np.round(angles / (2 * pi)), angles))


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Return the matrix that rotates vectors from the robot's frame to the world frame."""
    return np.array(rotation_matrix((0.0, 0.0, 0.0, *from_roll_pitch_yaw(roll, pitch, yaw)))).reshape(3, 3)


def transition(angles: Array, delta_s: float) -> Array:
    """Return the matrix that predicts the state after `delta_s`, for the current roll, pitch and yaw.

    Acceleration is constant: position += R(v Δ + a Δ²/2), v += a Δ. The rates of the angles are computed
    from the angular velocity in the robot's frame (Fossen, Guidance and Control of Ocean Vehicles,
    1994, section 2.1.2).
    """
    cr, sr, cp, sp = _functions(angles[0], angles[1])
    matrix = np.eye(SIZE)
    turned = rotation(*angles)
    matrix[POSITION, VELOCITY] = turned * delta_s
    matrix[POSITION, ACCELERATION] = turned * (0.5 * delta_s * delta_s)
    matrix[ANGLES, RATES] = (
        np.array([[1.0, sr * sp / cp, cr * sp / cp], [0.0, cr, -sr], [0.0, sr / cp, cr / cp]]) * delta_s
    )
    matrix[VELOCITY, ACCELERATION] = np.eye(3) * delta_s
    return matrix


def jacobian(state: Array, matrix: Array, delta_s: float) -> Array:
    """Return the derivative of the predicted state. `matrix` is the result of `transition` for the state.

    A rotation about an axis moves the end of a vector by the cross product of axis and vector. Roll is about
    the robot's x axis, yaw about the world's z axis, and pitch about the world's y axis rotated by the yaw.
    """
    cr, sr, cp, sp, cy, sy = _functions(*state[ANGLES])
    turned, speed = matrix[POSITION, VELOCITY], state[VELOCITY] + state[ACCELERATION] * (0.5 * delta_s)
    x, y, z = turned @ speed
    _, vpitch, vyaw = state[RATES]
    derivative = matrix.copy()
    derivative[POSITION, 3] = turned @ (0.0, -speed[2], speed[1])
    derivative[POSITION, 4] = cy * z, sy * z, -cy * x - sy * y
    derivative[POSITION, 5] = -y, x, 0.0
    along, across = sr * vpitch + cr * vyaw, cr * vpitch - sr * vyaw
    derivative[ANGLES, 3] += np.array([across * sp / cp, -along, across / cp]) * delta_s
    derivative[ANGLES, 4] += np.array([along / (cp * cp), 0.0, along * sp / (cp * cp)]) * delta_s
    return derivative


def _functions(*angles: float) -> list[float]:
    """Return the cosine and the sine of each angle."""
    return [function(angle) for angle in angles for function in (cos, sin)]
