"""Arrays from the fields of messages with covariances."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipros_libraries.transforms.messages import vector_of
from pipros_robot.navigation.filter.state import Array


def six(twist: Any) -> Array:
    """Return the linear and angular velocities of a twist."""
    return np.array((*vector_of(twist.linear), *vector_of(twist.angular)))


def rotational(covariance: Any) -> Array:
    """Embed a 3 x 3 covariance of rotations in a 6 x 6 covariance that is zero elsewhere."""
    return np.pad(square(covariance, 3), ((3, 0), (3, 0)))


def square(values: Any, size: int) -> Array:
    """Return a covariance as a matrix with `size` rows."""
    return np.array(values, float).reshape(size, size)


def is_missing(covariance: Any) -> bool:
    """Return whether a covariance says that the IMU does not measure the quantity."""
    return bool(abs(covariance[0] + 1) < 1e-9)
