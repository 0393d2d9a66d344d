"""Madgwick's filter: a gradient descent that corrects the integrated angular velocity.

S. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays", 2010. As
imu_filter_madgwick 1.2, it uses any world frame, and compensates drift only with a magnetometer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pipros_libraries.transforms.pose import Vector
from pipros_robot.perception.imu.attitude import (
    Quaternion,
    WorldAxes,
    inverse,
    orientation_at_rest,
    product,
    turned,
    unit,
    unit_quaternion,
)


class Madgwick:
    """The filter's state.

    Attributes:
        gain: weight of the correction (rad/s).
        zeta: weight of the correction of the gyroscope's drift (rad/s).
        orientation: from the IMU to the world; None before the first measurement.
    """

    def __init__(self, world: WorldAxes, gain: float = 0.1, zeta: float = 0.0) -> None:
        self.gain, self.zeta = gain, zeta
        self.orientation: Quaternion | None = None
        self._world = world
        self._drift: Vector = (0.0, 0.0, 0.0)

    def start(self, acceleration: Vector, field: Vector | None) -> bool:
        """Set the orientation to that of an IMU at rest. Return False if it cannot be determined."""
        found = orientation_at_rest(self._world, acceleration, field)
        self.orientation = found or self.orientation
        return found is not None

    def update(self, rate: Vector, acceleration: Vector, field: Vector | None, dt_s: float) -> None:
        """Add a measurement: angular velocity (rad/s), acceleration, and magnetic field in any unit."""
        q = self.orientation
        if q is None:
            return
        slope = self._slope(q, acceleration, field)
        if slope is not None and field is not None:
            error = product(inverse(q), slope)
            x, y, z = (old + 2 * self.zeta * dt_s * new for old, new in zip(self._drift, error, strict=False))
            self._drift = x, y, z
            x, y, z = (measured - drift for measured, drift in zip(rate, self._drift, strict=True))
            rate = x, y, z
        change = product(q, (*rate, 0.0))
        self.orientation = unit_quaternion(
            [
                old + dt_s * (0.5 * turn - self.gain * down)
                for old, turn, down in zip(q, change, slope or (0.0,) * 4, strict=True)
            ]
        )

    def _slope(self, q: Quaternion, acceleration: Vector, field: Vector | None) -> Quaternion | None:
        """Return the direction in which the error of the orientation grows, or None if there is none."""
        measured = unit(acceleration)
        if measured is None:
            return None
        slope = gradient(q, (0.0, 0.0, self._world.up), measured)
        magnetic = unit(field) if field is not None else None
        if magnetic is not None:
            x, y, z = turned(q, (magnetic[0], magnetic[1], magnetic[2]))
            level = math.hypot(x, y)
            expected = (0.0, level, z) if self._world.north else (level, 0.0, z)
            slope = [a + b for a, b in zip(slope, gradient(q, expected, magnetic), strict=True)]
        return unit_quaternion(slope)


def gradient(q: Quaternion, expected: Vector, measured: Sequence[float]) -> list[float]:
    """Return equation 20 of the report: the gradient of half the squared error, as x, y, z, w.

    The error is the `expected` direction in the world, converted to the IMU, minus the `measured` one.
    """
    x, y, z, w = q
    dx, dy, dz = (2 * each for each in expected)
    errors = (
        dx * (0.5 - y * y - z * z) + dy * (w * z + x * y) + dz * (x * z - w * y) - measured[0],
        dx * (x * y - w * z) + dy * (0.5 - x * x - z * z) + dz * (w * x + y * z) - measured[1],
        dx * (w * y + x * z) + dy * (y * z - w * x) + dz * (0.5 - x * x - y * y) - measured[2],
    )
    columns = (
        (dy * y + dz * z, dx * y - 2 * dy * x + dz * w, dx * z - dy * w - 2 * dz * x),
        (-2 * dx * y + dy * x - dz * w, dx * x + dz * z, dx * w + dy * z - 2 * dz * y),
        (-2 * dx * z + dy * w + dz * x, -dx * w - 2 * dy * z + dz * y, dx * x + dy * y),
        (dy * z - dz * y, -dx * z + dz * x, dx * y - dy * x),
    )
    return [sum(a * b for a, b in zip(column, errors, strict=True)) for column in columns]
