"""Points, vectors, poses and wrenches in other frames. None of it needs PyKDL but `transform_to_kdl`."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    Quaternion,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)

import tf2_ros
from pipros.lazy_names import star_names as _star_names
from pipros.transforms.pose import IDENTITY, composed, normalized
from pipros.transforms.pose import Pose as Numbers

_star_names(__name__, "copy PyKDL rospy")


def to_msg_msg(msg: Any) -> Any:
    """The message itself."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """The message itself."""
    return msg


def transform_to_kdl(t: Any) -> Any:
    """The transform as a PyKDL.Frame. Needs PyKDL, which no distribution of pip has under this name."""
    import PyKDL

    position, rotation = t.transform.translation, t.transform.rotation
    return PyKDL.Frame(
        PyKDL.Rotation.Quaternion(rotation.x, rotation.y, rotation.z, rotation.w),
        PyKDL.Vector(position.x, position.y, position.z),
    )


def _numbers(position: Any, rotation: Any) -> Numbers:
    if rotation.x == rotation.y == rotation.z == rotation.w == 0:  # a pose whose rotation nobody set
        return (position.x, position.y, position.z, *IDENTITY[3:])
    return (position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w)


def _moved(point: Any, transform: Any) -> tuple[float, float, float]:
    frame = _numbers(transform.transform.translation, transform.transform.rotation)
    return composed(frame, (point.x, point.y, point.z, *IDENTITY[3:]))[:3]


def _turned(vector: Any, transform: Any) -> tuple[float, float, float]:
    frame = (*IDENTITY[:3], *_numbers(transform.transform.translation, transform.transform.rotation)[3:])
    return composed(frame, (vector.x, vector.y, vector.z, *IDENTITY[3:]))[:3]


def do_transform_point(point: PointStamped, transform: Any) -> PointStamped:
    """The point in the frame that the transform leads to."""
    return PointStamped(transform.header, Point(*_moved(point.point, transform)))


def do_transform_vector3(vector3: Vector3Stamped, transform: Any) -> Vector3Stamped:
    """The vector in the frame that the transform leads to: turned, but not moved."""
    return Vector3Stamped(transform.header, Vector3(*_turned(vector3.vector, transform)))


def do_transform_pose(pose: PoseStamped, transform: Any) -> PoseStamped:
    """The pose in the frame that the transform leads to."""
    frame = _numbers(transform.transform.translation, transform.transform.rotation)
    found = normalized(composed(frame, _numbers(pose.pose.position, pose.pose.orientation)))
    return PoseStamped(transform.header, Pose(Point(*found[:3]), Quaternion(*found[3:])))


def do_transform_wrench(wrench: WrenchStamped, transform: Any) -> WrenchStamped:
    """The wrench in the frame that the transform leads to: force and torque turned, each by itself."""
    force, torque = _turned(wrench.wrench.force, transform), _turned(wrench.wrench.torque, transform)
    return WrenchStamped(transform.header, Wrench(Vector3(*force), Vector3(*torque)))


for _type in (Vector3Stamped, PoseStamped, PointStamped):
    tf2_ros.ConvertRegistration().add_to_msg(_type, to_msg_msg)
    tf2_ros.ConvertRegistration().add_from_msg(_type, from_msg_msg)
tf2_ros.TransformRegistration().add(PointStamped, do_transform_point)
tf2_ros.TransformRegistration().add(Vector3Stamped, do_transform_vector3)
tf2_ros.TransformRegistration().add(PoseStamped, do_transform_pose)
tf2_ros.TransformRegistration().add(WrenchStamped, do_transform_wrench)
