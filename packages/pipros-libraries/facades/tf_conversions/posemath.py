"""Conversions between PyKDL frames and tf tuples, Pose messages and matrices."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point as Point
from geometry_msgs.msg import Pose as Pose
from geometry_msgs.msg import Quaternion as Quaternion

try:
    import PyKDL as _PyKDL
    from PyKDL import *  # noqa: F403 # scripts import them from here
except ImportError:
    _PyKDL = None


def _kdl() -> Any:
    """Return the PyKDL module. Raise ImportError if it is not installed."""
    if _PyKDL is None:
        raise ImportError(
            "tf_conversions needs PyKDL: install the system package python3-pykdl, "
            "or a package such as conda-forge's python-orocos-kdl",
            name="PyKDL",
        )
    return _PyKDL


def __getattr__(name: str) -> Any:
    """Return a PyKDL attribute. Raise ImportError if PyKDL is not installed."""
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(_kdl(), name)


def _frame(rotation: Any, position: Any) -> Any:
    return _kdl().Frame(rotation, _kdl().Vector(*position))


def fromTf(tf: Any) -> Any:
    """Convert a position (x, y, z) and a quaternion (x, y, z, w), as returned by tf, to a frame."""
    position, quaternion = tf
    return _frame(_kdl().Rotation.Quaternion(*quaternion), position)


def toTf(f: Any) -> Any:
    """Convert a frame to a position (x, y, z) and a quaternion (x, y, z, w)."""
    return (f.p[0], f.p[1], f.p[2]), f.M.GetQuaternion()


def fromMsg(p: Pose) -> Any:
    """Convert a Pose to a frame."""
    position, quaternion = p.position, p.orientation
    rotation = _kdl().Rotation.Quaternion(quaternion.x, quaternion.y, quaternion.z, quaternion.w)
    return _frame(rotation, (position.x, position.y, position.z))


def toMsg(f: Any) -> Pose:
    """Convert a frame to a Pose."""
    return Pose(Point(f.p[0], f.p[1], f.p[2]), Quaternion(*f.M.GetQuaternion()))


def fromMatrix(m: Any) -> Any:
    """Convert a homogeneous 4x4 matrix to a frame."""
    rotation = _kdl().Rotation(*(float(m[row, column]) for row in range(3) for column in range(3)))
    return _frame(rotation, (float(m[row, 3]) for row in range(3)))


def toMatrix(f: Any) -> Any:
    """Convert a frame to a homogeneous 4x4 matrix. Requires numpy."""
    from pipros_libraries.transforms.matrices import numpy

    rows = [[*(f.M[row, column] for column in range(3)), f.p[row]] for row in range(3)]
    return numpy.array([*rows, [0, 0, 0, 1]])


def fromCameraParams(cv: Any, rvec: Any, tvec: Any) -> Any:
    """Convert a rotation vector (radians) and a translation vector, as returned by OpenCV, to a frame.

    `cv` is OpenCV's module (`cv2`). Requires numpy.
    """
    from pipros_libraries.transforms.matrices import numpy

    m = numpy.identity(4, dtype=numpy.float32)
    m[:3, 3] = numpy.asarray(tvec, dtype=numpy.float32).reshape(-1)[:3]
    if hasattr(cv, "Rodrigues2"):
        cv.Rodrigues2(rvec, m[:3, :3])
    else:
        m[:3, :3] = cv.Rodrigues(rvec)[0]
    return fromMatrix(m)
