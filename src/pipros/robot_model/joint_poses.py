"""Poses of links in their parents, from positions of joints, and when robot_state_publisher sends them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import cos, sin

from pipros.robot_model.urdf import Joint, Robot
from pipros.transforms.pose import Pose, composed

MOVING = ("revolute", "continuous", "prismatic")


def pose_of(joint: Joint, position: float) -> Pose:
    """The pose of a joint's child in its parent.

    Args:
        position: radians, metres for a prismatic joint; has no meaning for joints that do not move.
    """
    x, y, z = joint.axis
    if joint.type == "prismatic":
        return composed(joint.origin, (x * position, y * position, z * position, 0.0, 0.0, 0.0, 1.0))
    if joint.type in MOVING:
        s, c = sin(position / 2.0), cos(position / 2.0)
        return composed(joint.origin, (0.0, 0.0, 0.0, x * s, y * s, z * s, c))
    return joint.origin


class JointFrames:
    """The joints of a robot, and when each was sent last. Times are nanoseconds.

    Args:
        interval: a joint is sent again when its newest position is that much newer than the one sent last.
        every_message: whether stamps decide nothing (`ignore_timestamp`).
    """

    def __init__(self, robot: Robot, interval: int, every_message: bool = False) -> None:
        self.interval = interval
        self.every_message = every_message
        self.moving = {joint.name: joint for joint in robot.joints if joint.type in MOVING}
        # A planar joint counts as fixed, as genuine's reader takes it. Nothing is known of one that floats.
        self.fixed = [joint for joint in robot.joints if joint.type in ("fixed", "planar")]
        self.floating = [joint for joint in robot.joints if joint.type == "floating"]
        self._sent: dict[str, int] = {}

    def forget_times(self) -> None:
        """Makes each joint due at its next position, because the clock went back."""
        self._sent.clear()

    def due(self, names: Iterable[str], positions: Iterable[float], stamp: int) -> list[tuple[Joint, Pose]]:
        """The joints of a message that are to be sent, and those that mimic them, by name; or none.

        All of a message are sent when the one that waited longest is due.
        """
        known = dict(zip(names, positions, strict=True))
        if not known:
            return []
        oldest = min(self._sent.get(name, 0) for name in known)
        if not self.every_message and stamp < oldest + self.interval:
            return []
        for name in known:
            self._sent[name] = stamp
        values = self._with_mimics(known)
        return [
            (joint, pose_of(joint, values[name]))
            for name, joint in sorted(self.moving.items())
            if name in values
        ]

    def _with_mimics(self, known: Mapping[str, float]) -> dict[str, float]:
        values = dict(known)
        # A position in the message itself wins. Genuine finds chains of mimic joints in this order.
        for _, joint in sorted(self.moving.items()):
            mimic = joint.mimic
            if mimic is not None and mimic.joint in values:
                values.setdefault(joint.name, values[mimic.joint] * mimic.multiplier + mimic.offset)
        return values
