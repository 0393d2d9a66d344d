"""Functions that transform points, vectors, poses and wrenches. Only `transform_to_kdl` requires PyKDL."""

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
from pipros.basics.errors import MissingExtra
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms.messages import pose_of, vector_of
from pipros_libraries.transforms.pose import Pose as Numbers
from pipros_libraries.transforms.pose import composed, normalized, rotate, transform_point

_star_names(__name__, "copy PyKDL rospy")


def to_msg_msg(msg: Any) -> Any:
    """Return the message unchanged."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """Return the message unchanged."""
    return msg


def transform_to_kdl(t: Any) -> Any:
    """Return the transform as a PyKDL.Frame. Requires PyKDL (on Debian, `python3-pykdl`)."""
    try:
        import PyKDL
    except ImportError as error:
        raise MissingExtra(
            "transform_to_kdl needs PyKDL, which is not installed. On Debian: apt-get install python3-pykdl",
            name=error.name,
        ) from error
    position, rotation = t.transform.translation, t.transform.rotation
    return PyKDL.Frame(
        PyKDL.Rotation.Quaternion(rotation.x, rotation.y, rotation.z, rotation.w),
        PyKDL.Vector(position.x, position.y, position.z),
    )


def _frame(transform: Any) -> Numbers:
    return pose_of(transform.transform.translation, transform.transform.rotation)


def do_transform_point(point: PointStamped, transform: Any) -> PointStamped:
    """Apply the transform to a point."""
    found = transform_point(_frame(transform), vector_of(point.point))
    return PointStamped(transform.header, Point(*found))


def do_transform_vector3(vector3: Vector3Stamped, transform: Any) -> Vector3Stamped:
    """Apply the transform's rotation to a vector, without translating it."""
    found = rotate(_frame(transform), vector_of(vector3.vector))
    return Vector3Stamped(transform.header, Vector3(*found))


def do_transform_pose(pose: PoseStamped, transform: Any) -> PoseStamped:
    """Apply the transform to a pose."""
    found = normalized(composed(_frame(transform), pose_of(pose.pose.position, pose.pose.orientation)))
    return PoseStamped(transform.header, Pose(Point(*found[:3]), Quaternion(*found[3:])))


def do_transform_wrench(wrench: WrenchStamped, transform: Any) -> WrenchStamped:
    """Apply the transform's rotation to the force and the torque separately.

    As in Noetic, the torque that results from translating the force is not added.
    """
    frame = _frame(transform)
    force, torque = (rotate(frame, vector_of(part)) for part in (wrench.wrench.force, wrench.wrench.torque))
    return WrenchStamped(transform.header, Wrench(Vector3(*force), Vector3(*torque)))


for _type in (Vector3Stamped, PoseStamped, PointStamped):
    tf2_ros.ConvertRegistration().add_to_msg(_type, to_msg_msg)
    tf2_ros.ConvertRegistration().add_from_msg(_type, from_msg_msg)
tf2_ros.TransformRegistration().add(PointStamped, do_transform_point)
tf2_ros.TransformRegistration().add(Vector3Stamped, do_transform_vector3)
tf2_ros.TransformRegistration().add(PoseStamped, do_transform_pose)
tf2_ros.TransformRegistration().add(WrenchStamped, do_transform_wrench)
