"""Poses as PyKDL frames, messages, tf's lists and matrices."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point as Point
from geometry_msgs.msg import Pose as Pose
from geometry_msgs.msg import Quaternion as Quaternion

try:
    import PyKDL as _PyKDL
    from PyKDL import *  # noqa: F403 # scripts take them from here
except ImportError:
    _PyKDL = None


def _kdl() -> Any:
    """PyKDL. Raises ImportError where it is not installed."""
    if _PyKDL is None:
        raise ImportError(
            "tf_conversions needs PyKDL, which pip does not have: install python3-pykdl of your "
            "distribution, or a package such as conda-forge's python-orocos-kdl",
            name="PyKDL",
        )
    return _PyKDL


def __getattr__(name: str) -> Any:
    """The names of PyKDL, where it is not installed: an error that says so."""
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(_kdl(), name)


def _frame(rotation: Any, position: Any) -> Any:
    return _kdl().Frame(rotation, _kdl().Vector(*position))


def fromTf(tf: Any) -> Any:
    """The frame of a position (x, y, z) and a quaternion (x, y, z, w), as tf gives them."""
    position, quaternion = tf
    return _frame(_kdl().Rotation.Quaternion(*quaternion), position)


def toTf(f: Any) -> Any:
    """The position and the quaternion of a frame."""
    return (f.p[0], f.p[1], f.p[2]), f.M.GetQuaternion()


def fromMsg(p: Pose) -> Any:
    """The frame of a Pose."""
    at, turned = p.position, p.orientation
    rotation = _kdl().Rotation.Quaternion(turned.x, turned.y, turned.z, turned.w)
    return _frame(rotation, (at.x, at.y, at.z))


def toMsg(f: Any) -> Pose:
    """The Pose of a frame."""
    return Pose(Point(f.p[0], f.p[1], f.p[2]), Quaternion(*f.M.GetQuaternion()))


def fromMatrix(m: Any) -> Any:
    """The frame of a 4x4 matrix."""
    turned = _kdl().Rotation(*(float(m[row, column]) for row in range(3) for column in range(3)))
    return _frame(turned, (float(m[row, 3]) for row in range(3)))


def toMatrix(f: Any) -> Any:
    """The 4x4 matrix of a frame. Needs numpy."""
    from pipros.transforms.matrices import numpy

    rows = [[*(f.M[row, column] for column in range(3)), f.p[row]] for row in range(3)]
    return numpy.array([*rows, [0, 0, 0, 1]])


def fromCameraParams(cv: Any, rvec: Any, tvec: Any) -> Any:
    """The frame of what OpenCV's calibration gives.

    A rotation vector and a translation. `cv` is its module.
    """
    from pipros.transforms.matrices import numpy

    m = numpy.identity(4, dtype=numpy.float32)
    m[:3, 3] = numpy.asarray(tvec, dtype=numpy.float32).reshape(-1)[:3]
    if hasattr(cv, "Rodrigues2"):
        cv.Rodrigues2(rvec, m[:3, :3])
    else:
        m[:3, :3] = cv.Rodrigues(rvec)[0]
    return fromMatrix(m)
