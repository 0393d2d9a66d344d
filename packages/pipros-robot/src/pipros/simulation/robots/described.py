"""Poses of sensors in a robot description (URDF)."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

from pipros.libraries.robot_model.urdf import read_robot
from pipros.libraries.transforms.pose import IDENTITY, composed, roll_pitch_yaw
from pipros.libraries.transforms.pose import Pose as SpatialPose
from pipros.simulation.robots.settings import Laser


def placed_laser(laser: Laser, description: str, frame: str, bases: Collection[str]) -> Laser:
    """Return the laser at its pose in a robot description, or unchanged if the description lacks its frame.

    A laser that is mounted upside down measures clockwise. Any other inclination is ignored.

    Raises:
        UrdfError: the description is invalid.
    """
    pose = pose_of(description, frame, bases)
    if pose is None:
        return laser
    x, y, z = pose[:3]
    roll, _, yaw = roll_pitch_yaw(pose)
    is_upside_down = abs(roll) > math.pi / 2
    return replace(laser, x=x, y=y, z=z, yaw=yaw, is_upside_down=is_upside_down)


def pose_of(description: str, frame: str, bases: Collection[str]) -> SpatialPose | None:
    """Return a link's pose relative to the closest of the links `bases` above it, or to the root.

    All joints are at 0. Return None if no joint moves the link.

    Raises:
        UrdfError: the description is invalid.
    """
    parents = {joint.child: joint for joint in read_robot(description).joints}
    if frame not in parents:
        return None
    pose = IDENTITY
    while frame in parents and frame not in bases:
        pose = composed(parents[frame].origin, pose)
        frame = parents[frame].parent
    return pose
