"""Poses in the plane, as (x, y, yaw) in metres and radians, and messages with them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipros.libraries.transforms.messages import pose_of
from pipros.libraries.transforms.pose import Pose, roll_pitch_yaw
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time

Triple = tuple[float, float, float]
Poses = NDArray[np.float64]


def flat(pose: Pose) -> Triple:
    """Return the part of a pose in the plane."""
    return pose[0], pose[1], roll_pitch_yaw(pose)[2]


def flat_message(pose: Any) -> Triple:
    """Return the part in the plane of a geometry_msgs/Pose."""
    return flat(pose_of(pose.position, pose.orientation))


def in_frame(frame: Triple, poses: Poses) -> Poses:
    """Convert poses relative to `frame`, shape (n, 3), to the frame that `frame` is relative to."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    x, y, yaw = poses.T
    placed: Poses = np.column_stack(
        (frame[0] + cosine * x - sine * y, frame[1] + sine * x + cosine * y, yaw + frame[2])
    )
    return placed


def raised(pose: Triple) -> Pose:
    """Return a pose in the plane as a pose in space."""
    return (pose[0], pose[1], 0.0, 0.0, 0.0, math.sin(pose[2] / 2), math.cos(pose[2] / 2))


def time_of(stamp_ns: int) -> Time:
    return Time(*divmod(max(0, stamp_ns), NS_PER_S))


def transforms(parent: str, child: str, pose: Pose, stamp_ns: int) -> Any:
    """Return a tf2_msgs/TFMessage with one transform."""
    transform: Any = load_message_class("geometry_msgs/TransformStamped")(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = parent, time_of(stamp_ns)
    shift, turn = transform.transform.translation, transform.transform.rotation
    shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w = pose
    message: Any = load_message_class("tf2_msgs/TFMessage")
    return message([transform])


def stamped_pose(pose: Triple, frame: str, stamp: Time) -> Any:
    """Return a geometry_msgs/PoseStamped."""
    message: Any = load_message_class("geometry_msgs/PoseStamped")()
    message.header.frame_id, message.header.stamp = frame, stamp
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y = pose[0], pose[1]
    turn.z, turn.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
    return message


def path(poses: Iterable[Any], frame: str, stamp: Time) -> Any:
    """Return a nav_msgs/Path with these poses, each (x, y, yaw)."""
    message: Any = load_message_class("nav_msgs/Path")()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.poses = [stamped_pose((float(x), float(y), float(yaw)), frame, stamp) for x, y, yaw in poses]
    return message


def twist(velocity: Triple) -> Any:
    """Return a geometry_msgs/Twist with velocities along x and y and around z."""
    message: Any = load_message_class("geometry_msgs/Twist")()
    message.linear.x, message.linear.y, message.angular.z = velocity
    return message


def cloud(names: Iterable[str], values: NDArray[Any], frame: str, stamp: Time) -> Any:
    """Return a sensor_msgs/PointCloud2 of float32 fields, from an array of shape (n, fields)."""
    message: Any = load_message_class("sensor_msgs/PointCloud2")()
    field: Any = load_message_class("sensor_msgs/PointField")
    message.header.frame_id, message.header.stamp = frame, stamp
    message.fields = [field(name, 4 * index, field.FLOAT32, 1) for index, name in enumerate(names)]
    message.height, message.width = 1, len(values)
    message.point_step = 4 * len(message.fields)
    message.row_step = message.point_step * len(values)
    message.is_dense = True
    message.data = values.astype("<f4").tobytes()
    return message
