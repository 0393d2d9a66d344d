"""Drop-in replacement for Noetic's tf_conversions: conversion of poses to and from PyKDL.

The module also provides PyKDL's names.
"""

from typing import Any as _Any

from pipros.basics.lazy_names import star_names as _star_names
from tf_conversions import posemath as posemath
from tf_conversions.posemath import *  # noqa: F403 # the names of PyKDL, as Noetic has it


def __getattr__(name: str) -> _Any:
    """Return a PyKDL attribute. Raise ImportError if PyKDL is not installed."""
    return getattr(posemath, name)


_star_names(__name__, "numpy rospy tf tf.transformations")
_star_names("tf_conversions.posemath", "numpy rospy tf tf.transformations")
