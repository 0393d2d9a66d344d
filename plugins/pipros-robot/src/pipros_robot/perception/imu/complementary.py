"""The complementary filter of imu_complementary_filter 1.2: scaled corrections of tilt and heading.

R. Valenti, I. Dryanovski, J. Xiao, "Keeping a good attitude: a quaternion-based orientation filter for IMUs
and MARGs", 2015. The world's z axis points up, and its x axis to magnetic north.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from pipros_libraries.transforms.pose import Vector
from pipros_robot.perception.imu.attitude import IDENTITY, Quaternion, product, turned, unit, unit_quaternion

GRAVITY: Final = 9.81
_STEADY_ACCELERATION: Final = 0.1
_STEADY_CHANGE: Final = 0.01
_STEADY_RATE: Final = 0.2
"""An IMU is steady if its acceleration differs less from gravity (m/s²), its angular velocity less from the
last one, and less from the bias (rad/s)."""

_FULL_GAIN_ERROR, _NO_GAIN_ERROR = 0.1, 0.2
"""Relative errors of the acceleration between which an adaptive gain decreases to 0."""

_SLERP_BELOW: Final = 0.9
_UPSIDE_DOWN: Final[Quaternion] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Gains:
    """The filter's parameters, named as those of the node."""

    gain_acc: float = 0.01
    gain_mag: float = 0.01
    bias_alpha: float = 0.01
    do_bias_estimation: bool = True
    do_adaptive_gain: bool = True


class Complementary:
    """The filter's state.

    Attributes:
        orientation: from the IMU to the world; None before the first measurement.
        bias: the estimated bias of the angular velocity.
        is_steady: whether the last measurement was made at rest.
    """

    def __init__(self, gains: Gains) -> None:
        self.orientation: Quaternion | None = None
        self.bias: Vector = (0.0, 0.0, 0.0)
        self.is_steady = False
        self._gains = gains
        self._last_rate: Vector = (0.0, 0.0, 0.0)

    def update(self, rate: Vector, acceleration: Vector, field: Vector | None, dt_s: float) -> None:
        """Add a measurement: angular velocity (rad/s), acceleration (m/s²), and field in any unit."""
        if self.orientation is None:
            self.orientation = self._corrected(IDENTITY, acceleration, field, 1.0, 1.0)
            return
        if self._gains.do_bias_estimation:
            self._estimate_bias(rate, acceleration)
        x, y, z = ((each - bias) * dt_s / 2 for each, bias in zip(rate, self.bias, strict=True))
        predicted = unit_quaternion(product(self.orientation, (x, y, z, 1.0)))
        gain = self._gains.gain_acc
        if self._gains.do_adaptive_gain:
            error = abs(math.hypot(*acceleration) - GRAVITY) / GRAVITY
            gain *= min(max((_NO_GAIN_ERROR - error) / (_NO_GAIN_ERROR - _FULL_GAIN_ERROR), 0.0), 1.0)
        if predicted is not None:
            predicted = self._corrected(predicted, acceleration, field, gain, self._gains.gain_mag)
        self.orientation = predicted

    def _corrected(
        self, q: Quaternion, acceleration: Vector, field: Vector | None, gain: float, field_gain: float
    ) -> Quaternion | None:
        up = unit(turned(q, acceleration))
        if up is not None:
            x, y, z = up
            level = unit_quaternion((y, -x, 0.0, 1.0 + z)) or _UPSIDE_DOWN
            q = product(_scaled(level, gain), q)
        if field is not None:
            x, y, _ = turned(q, field)
            if x or y:
                half = -math.atan2(y, x) / 2
                q = product(_scaled((0.0, 0.0, math.sin(half), math.cos(half)), field_gain), q)
        return unit_quaternion(q)

    def _estimate_bias(self, rate: Vector, acceleration: Vector) -> None:
        changes = [abs(now - last) for now, last in zip(rate, self._last_rate, strict=True)]
        errors = [now - bias for now, bias in zip(rate, self.bias, strict=True)]
        self._last_rate = rate
        self.is_steady = (
            abs(math.hypot(*acceleration) - GRAVITY) <= _STEADY_ACCELERATION
            and max(changes) <= _STEADY_CHANGE
            and max(map(abs, errors)) <= _STEADY_RATE
        )
        if self.is_steady:
            x, y, z = (
                bias + self._gains.bias_alpha * error for bias, error in zip(self.bias, errors, strict=True)
            )
            self.bias = x, y, z


def _scaled(rotation: Quaternion, gain: float) -> Quaternion:
    """Return a rotation that is closer to none: interpolated linearly if it is small, otherwise by slerp."""
    x, y, z, w = rotation
    if w < _SLERP_BELOW:
        angle = math.acos(max(w, -1.0))
        rest, part = (math.sin(each * angle) / math.sin(angle) for each in (1.0 - gain, gain))
    else:
        rest, part = 1.0 - gain, gain
    return unit_quaternion((part * x, part * y, part * z, rest + part * w)) or IDENTITY
