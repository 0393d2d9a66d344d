"""tf_conversions, as Noetic has it, on pipros: poses to and from PyKDL, whose names it has, too."""

from tf_conversions.posemath import *  # noqa: F403 # the names of PyKDL, as Noetic has it
