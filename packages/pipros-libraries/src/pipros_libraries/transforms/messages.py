"""Convert poses and times from ROS messages, or from any objects with the same fields."""

from __future__ import annotations

from typing import Any

from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.pose import IDENTITY, Pose, Vector


def vector_of(message: Any) -> Vector:
    """Return the coordinates of a Point, Point32 or Vector3."""
    return message.x, message.y, message.z


def pose_of(position: Any, rotation: Any) -> Pose:
    """Return the pose for a position and a Quaternion.

    A quaternion of four zeros, the default, means no rotation, as does one whose square is hardly
    more than 0.
    """
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    if x * x + y * y + z * z + w * w < 1e-300:
        return (position.x, position.y, position.z, *IDENTITY[3:])
    return (position.x, position.y, position.z, x, y, z, w)


def pose_of_transform(transform: Any) -> Pose:
    """Return the pose in a Transform as floats, without normalizing the quaternion."""
    position, rotation = transform.translation, transform.rotation
    return (
        float(position.x),
        float(position.y),
        float(position.z),
        float(rotation.x),
        float(rotation.y),
        float(rotation.z),
        float(rotation.w),
    )


def in_ns(time: Any) -> int:
    """Convert a time or a duration to nanoseconds.

    Raises:
        TypeError: the value is neither a time nor a duration.
    """
    try:
        return int(time.secs * NS_PER_S + time.nsecs)
    except AttributeError:
        if hasattr(time, "to_sec"):
            return round(float(time.to_sec()) * NS_PER_S)
        raise TypeError("time must have a to_sec method, e.g. rospy.Time or rospy.Duration") from None
