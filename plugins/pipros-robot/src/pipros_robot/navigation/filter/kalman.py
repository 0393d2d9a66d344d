"""The extended Kalman filter (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, table 3.3).

`state.transition` is the motion model. A measurement consists of state variables, so the measurement model is
a selection of rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pipros_robot.navigation.filter.state import (
    ACCELERATION,
    ANGLES,
    POSE,
    RATES,
    SIZE,
    TWIST,
    Array,
    Flags,
    Measurement,
    VelocityCommand,
    jacobian,
    transition,
    wrapped,
)

DEFAULT_PROCESS_NOISE: Final = np.diag(
    [0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015]
)
DEFAULT_COVARIANCE: Final = np.eye(SIZE) * 1e-9
_SLACK = 0.01
"""Tolerance in m/s or rad/s when comparing the directions of a command and the velocity."""


@dataclass(slots=True, eq=False)
class Control:
    """The response to commands: a controller with limits for each of vx, vy, vz, vroll, vpitch and vyaw.

    Attributes:
        flags: the controlled axes.
        acceleration_limits, deceleration_limits: in m/s² or rad/s².
        acceleration_gains, deceleration_gains: acceleration per velocity difference, in 1/s.
        timeout_s: older commands count as a command to stop.
        command: the newest command.
    """

    flags: Flags
    acceleration_limits: Array
    acceleration_gains: Array
    deceleration_limits: Array
    deceleration_gains: Array
    timeout_s: float
    command: VelocityCommand | None = None

    def accelerations(self, velocity: Array, time_s: float) -> tuple[Flags, Array]:
        """Return the controlled axes and the accelerations, which are 0 for other axes.

        An axis decelerates if the command is slower than `velocity`, or has the opposite sign.
        """
        wanted = np.zeros(6)
        if self.command is not None and time_s - self.command.time_s < self.timeout_s:
            wanted = self.command.velocity
        difference = wanted - velocity
        goal = np.where(np.abs(difference) <= np.abs(wanted) + _SLACK, wanted, 0.0)
        brakes = np.abs(goal) < np.abs(velocity)
        limit = np.where(brakes, self.deceleration_limits, self.acceleration_limits)
        gain = np.where(brakes, self.deceleration_gains, self.acceleration_gains)
        found = np.clip(gain * difference, -limit, limit)
        return self.flags, np.where(self.flags, found, 0.0)


class ExtendedKalmanFilter:
    """An estimated state and its covariance, which can be predicted and corrected.

    Attributes:
        state: the 15 variables described in `state.py`.
        covariance: 15 x 15 matrix.
    """

    def __init__(
        self,
        *,
        process_noise: Array = DEFAULT_PROCESS_NOISE,
        covariance: Array = DEFAULT_COVARIANCE,
        state: Array | None = None,
        control: Control | None = None,
        is_noise_dynamic: bool = False,
    ) -> None:
        """Start with the given estimate.

        Args:
            process_noise: covariance that is added per second of prediction.
            covariance, state: the initial estimate. The state defaults to 0.
            control: the robot's response to commands.
            is_noise_dynamic: whether to scale the pose's noise by the squared norm of the velocities.
        """
        self.state = np.zeros(SIZE) if state is None else np.array(state, float)
        self.covariance = np.array(covariance, float)
        self.control = control
        self._process_noise = np.array(process_noise, float)
        self._is_noise_dynamic = is_noise_dynamic

    def predict(self, time_s: float, delta_s: float) -> None:
        """Predict the estimate at `time_s`, which is `delta_s` seconds later."""
        matrix = transition(self.state[ANGLES], delta_s)
        derivative = jacobian(self.state, matrix, delta_s)
        noise = self._noise(delta_s)
        self._apply_control(time_s, delta_s)
        self.state = self._normal(matrix @ self.state)
        self.covariance = derivative @ self.covariance @ derivative.T + noise

    def correct(self, measurement: Measurement) -> bool:
        """Update the estimate with a measurement. Return False if it was rejected or has no usable values."""
        indices = measurement.usable()
        if not len(indices):
            return False
        noise = measurement.noise(indices)
        innovation = self._innovation(measurement, indices)
        mixed = self.covariance[:, indices]
        inverse = np.linalg.inv(mixed[indices] + noise)
        if not innovation @ inverse @ innovation < measurement.threshold * measurement.threshold:
            return False
        gain = mixed @ inverse
        self.state = self._normal(self.state + gain @ innovation)
        rest = np.eye(SIZE)
        rest[:, indices] -= gain
        self.covariance = rest @ self.covariance @ rest.T + gain @ noise @ gain.T
        return True

    def start(self, measurement: Measurement) -> None:
        """Use the measured variables as the initial estimate."""
        indices = measurement.usable()
        self.state[indices] = measurement.values[indices]
        grid = np.ix_(indices, indices)
        self.covariance[grid] = measurement.covariance[grid]

    def _innovation(self, measurement: Measurement, indices: np.ndarray) -> Array:  # type: ignore[type-arg]
        innovation: Array = measurement.values[indices] - self.state[indices]
        angles = (indices >= ANGLES.start) & (indices < ANGLES.stop)
        innovation[angles] = wrapped(innovation[angles])
        return innovation

    def _noise(self, delta_s: float) -> Array:
        noise = self._process_noise * delta_s
        if self._is_noise_dynamic:
            noise[POSE, POSE] *= self.state[TWIST] @ self.state[TWIST]
        return noise

    def _apply_control(self, time_s: float, delta_s: float) -> None:
        """Set the controlled linear accelerations, and change the controlled angular velocities."""
        if self.control is not None:
            used, accelerations = self.control.accelerations(self.state[TWIST], time_s)
            self.state[RATES] += accelerations[3:] * delta_s
            self.state[ACCELERATION] = np.where(used[:3], accelerations[:3], self.state[ACCELERATION])

    @staticmethod
    def _normal(state: Array) -> Array:
        state[ANGLES] = wrapped(state[ANGLES])
        return state
