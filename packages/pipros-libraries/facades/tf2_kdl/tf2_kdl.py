"""Functions that transform PyKDL's vectors, frames, twists and wrenches, registered with tf2_ros.

Transformed values have a `header`. Objects of PyKDL 1.5 reject new attributes; with that version, results are
instances of subclasses defined here. Genuine tf2_kdl raises AttributeError with PyKDL 1.5.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, PointStamped, TransformStamped
from std_msgs.msg import Header

import tf2_ros
from pipros.basics.errors import MissingExtra
from tf2_geometry_msgs import transform_to_kdl as transform_to_kdl

try:
    import PyKDL
except ImportError as error:
    raise MissingExtra(
        "tf2_kdl needs PyKDL: install the system package python3-pykdl, and use the system's Python",
        name="PyKDL",
    ) from error


class _Vector(PyKDL.Vector):  # type: ignore[misc]
    """Vector that accepts a header."""


class _Frame(PyKDL.Frame):  # type: ignore[misc]
    """Frame that accepts a header."""


class _Twist(PyKDL.Twist):  # type: ignore[misc]
    """Twist that accepts a header."""


class _Wrench(PyKDL.Wrench):  # type: ignore[misc]
    """Wrench that accepts a header."""


_WITH_HEADER = {PyKDL.Vector: _Vector, PyKDL.Frame: _Frame, PyKDL.Twist: _Twist, PyKDL.Wrench: _Wrench}


def _stamped(value: Any, header: Header) -> Any:
    try:
        value.header = header
    except AttributeError:
        value = _WITH_HEADER[type(value)](value)
        value.header = header
    return value


def do_transform_vector(vector: Any, transform: TransformStamped) -> Any:
    """Apply the transform to a vector, which is rotated and translated like a point."""
    return _stamped(transform_to_kdl(transform) * vector, transform.header)


def do_transform_frame(frame: Any, transform: TransformStamped) -> Any:
    """Apply the transform to a frame."""
    return _stamped(transform_to_kdl(transform) * frame, transform.header)


def do_transform_twist(twist: Any, transform: TransformStamped) -> Any:
    """Apply the transform to a twist. The result refers to the origin of the target frame."""
    return _stamped(transform_to_kdl(transform) * twist, transform.header)


def do_transform_wrench(wrench: Any, transform: TransformStamped) -> Any:
    """Apply the transform to a wrench. The result refers to the origin of the target frame."""
    return _stamped(transform_to_kdl(transform) * wrench, transform.header)


def to_msg_vector(vector: Any) -> PointStamped:
    """Convert a vector with a header to a PointStamped."""
    return PointStamped(vector.header, Point(vector[0], vector[1], vector[2]))


def from_msg_vector(msg: PointStamped) -> Any:
    """Convert a PointStamped to a vector with a header."""
    header = Header(stamp=msg.header.stamp, frame_id=msg.header.frame_id)
    return _stamped(PyKDL.Vector(msg.point.x, msg.point.y, msg.point.z), header)


def convert_vector(vector: Any) -> Any:
    """Return a copy of a vector, including its header."""
    return _stamped(PyKDL.Vector(vector), Header(stamp=vector.header.stamp, frame_id=vector.header.frame_id))


for _types, _transform in (
    ((PyKDL.Vector, _Vector), do_transform_vector),
    ((PyKDL.Frame, _Frame), do_transform_frame),
    ((PyKDL.Twist, _Twist), do_transform_twist),
    ((PyKDL.Wrench, _Wrench), do_transform_wrench),
):
    for _type in _types:
        tf2_ros.TransformRegistration().add(_type, _transform)
for _type in (PyKDL.Vector, _Vector):
    tf2_ros.ConvertRegistration().add_to_msg(_type, to_msg_vector)
    tf2_ros.ConvertRegistration().add_from_msg(_type, from_msg_vector)
    tf2_ros.ConvertRegistration().add_convert((_type, PyKDL.Vector), convert_vector)
