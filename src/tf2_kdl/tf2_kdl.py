"""Vectors, frames, twists and wrenches of PyKDL in other frames, registered with tf2_ros.

Transformed values have a `header`. Objects of PyKDL 1.5 take no attributes; transformed ones are of classes
of this module then, which have PyKDL's as bases. Genuine tf2_kdl raises AttributeError with that PyKDL.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, PointStamped, TransformStamped
from std_msgs.msg import Header

import tf2_ros
from tf2_geometry_msgs import transform_to_kdl as transform_to_kdl

try:
    import PyKDL
except ImportError as error:
    raise ImportError(
        "tf2_kdl needs PyKDL, which pip does not have: install python3-pykdl of your system for its Python",
        name="PyKDL",
    ) from error


class _Vector(PyKDL.Vector):  # type: ignore[misc]
    """A vector that can have a header."""


class _Frame(PyKDL.Frame):  # type: ignore[misc]
    """A frame that can have a header."""


class _Twist(PyKDL.Twist):  # type: ignore[misc]
    """A twist that can have a header."""


class _Wrench(PyKDL.Wrench):  # type: ignore[misc]
    """A wrench that can have a header."""


_WITH_HEADER = {PyKDL.Vector: _Vector, PyKDL.Frame: _Frame, PyKDL.Twist: _Twist, PyKDL.Wrench: _Wrench}


def _stamped(value: Any, header: Header) -> Any:
    try:
        value.header = header
    except AttributeError:
        value = _WITH_HEADER[type(value)](value)
        value.header = header
    return value


def do_transform_vector(vector: Any, transform: TransformStamped) -> Any:
    """A vector in the frame that the transform leads to: turned, and moved as a point is."""
    return _stamped(transform_to_kdl(transform) * vector, transform.header)


def do_transform_frame(frame: Any, transform: TransformStamped) -> Any:
    """A frame seen from the frame that the transform leads to."""
    return _stamped(transform_to_kdl(transform) * frame, transform.header)


def do_transform_twist(twist: Any, transform: TransformStamped) -> Any:
    """A twist in the frame that the transform leads to, about that frame's origin."""
    return _stamped(transform_to_kdl(transform) * twist, transform.header)


def do_transform_wrench(wrench: Any, transform: TransformStamped) -> Any:
    """A wrench in the frame that the transform leads to, about that frame's origin."""
    return _stamped(transform_to_kdl(transform) * wrench, transform.header)


def to_msg_vector(vector: Any) -> PointStamped:
    """A vector with a header as a message."""
    return PointStamped(vector.header, Point(vector[0], vector[1], vector[2]))


def from_msg_vector(msg: PointStamped) -> Any:
    """The vector of a message, with its header."""
    header = Header(stamp=msg.header.stamp, frame_id=msg.header.frame_id)
    return _stamped(PyKDL.Vector(msg.point.x, msg.point.y, msg.point.z), header)


def convert_vector(vector: Any) -> Any:
    """A copy of a vector with a header."""
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
