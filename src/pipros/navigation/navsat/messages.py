"""The messages that navsat_transform_node publishes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipros.libraries.transforms.pose import Pose, Vector, rotation_matrix
from pipros.msg import load_message_class
from pipros.navigation.plane import time_of

Array = NDArray[np.float64]


def position(frame: str, stamp_ns: int, place: Vector, covariance: Array) -> Any:
    """Return a position as nav_msgs/Odometry, with its covariance of the shape (3, 3)."""
    message: Any = load_message_class("nav_msgs/Odometry")()
    message.header.frame_id, message.header.stamp = frame, time_of(stamp_ns)
    pose = message.pose.pose
    pose.position.x, pose.position.y, pose.position.z = place
    pose.orientation.w = 1.0
    whole = np.zeros((6, 6))
    whole[:3, :3] = covariance
    message.pose.covariance = whole.ravel().tolist()
    return message


def filtered_fix(frame: str, stamp_ns: int, place: Vector, covariance: Array) -> Any:
    """Return latitude, longitude and altitude as sensor_msgs/NavSatFix."""
    message: Any = load_message_class("sensor_msgs/NavSatFix")()
    message.header.frame_id, message.header.stamp = frame, time_of(stamp_ns)
    message.latitude, message.longitude, message.altitude = place
    message.position_covariance = covariance.ravel().tolist()
    message.position_covariance_type = message.COVARIANCE_TYPE_KNOWN
    message.status.status = message.status.STATUS_GBAS_FIX
    return message


def turned(pose: Pose, covariance: Array) -> Array:
    """Return a covariance, shape (3, 3), in the parent of a frame with this pose."""
    matrix = np.array(rotation_matrix(pose)).reshape(3, 3)
    found: Array = matrix @ covariance @ matrix.T
    return found
