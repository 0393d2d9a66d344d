"""tf_conversions, as Noetic has it, on pipros: poses to and from PyKDL, whose names it has, too."""

from typing import Any as _Any

from pipros.lazy_names import star_names as _star_names
from tf_conversions import posemath as posemath
from tf_conversions.posemath import *  # noqa: F403 # the names of PyKDL, as Noetic has it


def __getattr__(name: str) -> _Any:
    """The names of PyKDL, where it is not installed: an error that says so."""
    return getattr(posemath, name)


_star_names(__name__, "numpy rospy tf tf.transformations")
_star_names("tf_conversions.posemath", "numpy rospy tf tf.transformations")
