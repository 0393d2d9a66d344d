"""The messages that navsat_transform_node publishes."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipros.libraries.nodes.wiring import stamped
from pipros.libraries.transforms.pose import IDENTITY, Pose, Vector, rotation_matrix
from pipros.navigation import plane
from pipros.navigation.plane import Poses


def position(frame: str, stamp_ns: int, place: Vector, covariance: Poses) -> Any:
    """Return a position and its covariance, of shape (3, 3), as nav_msgs/Odometry."""
    message = stamped("nav_msgs/Odometry", frame, stamp_ns)
    plane.fill(message.pose.pose.position, message.pose.pose.orientation, (*place, *IDENTITY[3:]))
    message.pose.covariance = np.pad(covariance, (0, 3)).ravel().tolist()
    return message


def filtered_fix(frame: str, stamp_ns: int, place: Vector, covariance: Poses) -> Any:
    """Return latitude, longitude and altitude as sensor_msgs/NavSatFix."""
    message = stamped("sensor_msgs/NavSatFix", frame, stamp_ns)
    message.latitude, message.longitude, message.altitude = place
    message.position_covariance = covariance.ravel().tolist()
    message.position_covariance_type = message.COVARIANCE_TYPE_KNOWN
    message.status.status = message.status.STATUS_GBAS_FIX
    return message


def turned(pose: Pose, covariance: Poses) -> Poses:
    """Rotate a covariance of shape (3, 3) from a frame with the given pose to its parent frame."""
    matrix = np.array(rotation_matrix(pose)).reshape(3, 3)
    found: Poses = matrix @ covariance @ matrix.T
    return found
