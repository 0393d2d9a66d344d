"""Joints of a robot description that the simulated robot moves, and those that it does not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pipros_libraries.robot_model.urdf import Robot

_MOVED: Final = ("continuous", "revolute", "prismatic")


def wheel_joints(robot: Robot) -> list[str]:
    """Return the first joints of a wheel on the left and on the right, or an empty list."""
    wheels = [
        [
            joint.name
            for joint in robot.joints
            if joint.type == "continuous" and side in joint.name + joint.child
        ]
        for side in ("left", "right")
    ]
    return [wheels[0][0], wheels[1][0]] if all(wheels) else []


def moved_joints(robot: Robot, left_out: Sequence[str]) -> list[str]:
    """Return the joints that need joint states, except those that are left out."""
    return [
        joint.name
        for joint in robot.joints
        if joint.type in _MOVED and joint.mimic is None and joint.name not in left_out
    ]
