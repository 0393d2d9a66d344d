"""Quaternions (x, y, z, w) that convert vectors from an IMU to the world, and the orientation at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from pipros_libraries.transforms.pose import Vector, composed, from_roll_pitch_yaw, rotate

Quaternion = tuple[float, float, float, float]

IDENTITY: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)
_LEAST_ACCELERATION: Final = 0.1
_LEAST_HORIZONTAL: Final = 1e-7
"""Horizontal share of the magnetic field below which it shows no direction."""


@dataclass(frozen=True, slots=True)
class WorldAxes:
    """The axes of a world frame.

    Attributes:
        up: the z component of the direction up, 1 or -1.
        north: the angle of north about the z axis.
    """

    up: float
    north: float


WORLDS: Final = {"enu": WorldAxes(1.0, math.pi / 2), "nwu": WorldAxes(1.0, 0.0), "ned": WorldAxes(-1.0, 0.0)}


def product(first: Quaternion, second: Quaternion) -> Quaternion:
    return composed((0.0, 0.0, 0.0, *first), (0.0, 0.0, 0.0, *second))[3:]


def turned(orientation: Quaternion, vector: Vector) -> Vector:
    """Convert a vector from the IMU to the world."""
    return rotate((0.0, 0.0, 0.0, *orientation), vector)


def inverse(orientation: Quaternion) -> Quaternion:
    x, y, z, w = orientation
    return -x, -y, -z, w


def unit(values: Sequence[float]) -> list[float] | None:
    """Return a vector or quaternion with the norm 1, or None if its norm is 0 or not finite."""
    norm = math.hypot(*values)
    return [each / norm for each in values] if 0 < norm < math.inf else None


def unit_quaternion(values: Sequence[float]) -> Quaternion | None:
    """Return the quaternion with the norm 1, or None."""
    found = unit(values)
    return None if found is None else (found[0], found[1], found[2], found[3])


def orientation_at_rest(
    world: WorldAxes, acceleration: Vector, field: Vector | None = None
) -> Quaternion | None:
    """Return the orientation of an IMU at rest. Without a magnetic field, its yaw is 0.

    Return None if the IMU is in free fall, or the field is vertical.
    """
    if math.hypot(*acceleration) < _LEAST_ACCELERATION:
        return None
    x, y, z = (world.up * each for each in acceleration)
    tilt = from_roll_pitch_yaw(math.atan2(y, z), math.atan2(-x, math.hypot(y, z)), 0.0)
    if field is None:
        return tilt
    x, y, _ = turned(tilt, field)
    if math.hypot(x, y) <= _LEAST_HORIZONTAL * math.hypot(*field):
        return None
    return product(from_roll_pitch_yaw(0.0, 0.0, world.north - math.atan2(y, x)), tilt)
