"""Link poses computed from joint positions, and the rate limit of robot_state_publisher."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import cos, sin

from pipros_libraries.robot_model.urdf import Joint, Robot
from pipros_libraries.transforms.pose import Pose, composed

MOVING = ("revolute", "continuous", "prismatic")


def pose_of(joint: Joint, position: float) -> Pose:
    """Return the pose of a joint's child link relative to its parent link.

    Args:
        position: in radians, or in metres for a prismatic joint; ignored for types not in `MOVING`.
    """
    x, y, z = joint.axis
    if joint.type == "prismatic":
        return composed(joint.origin, (x * position, y * position, z * position, 0.0, 0.0, 0.0, 1.0))
    if joint.type in MOVING:
        s, c = sin(position / 2.0), cos(position / 2.0)
        return composed(joint.origin, (0.0, 0.0, 0.0, x * s, y * s, z * s, c))
    return joint.origin


class JointFrames:
    """A robot's joints, and each joint's last published timestamp. Times are in nanoseconds.

    Args:
        interval: minimum difference between the timestamps of two published positions of a joint.
        every_message: whether to publish every message regardless of its timestamp (`ignore_timestamp`).

    Attributes:
        moving: revolute, continuous and prismatic joints, by name.
        fixed: fixed joints. Planar joints are treated as fixed, as in Noetic.
        floating: floating joints, whose poses cannot be computed from a position.
    """

    def __init__(self, robot: Robot, interval: int, every_message: bool = False) -> None:
        self.interval = interval
        self.every_message = every_message
        self.moving = {joint.name: joint for joint in robot.joints if joint.type in MOVING}
        self.fixed = [joint for joint in robot.joints if joint.type in ("fixed", "planar")]
        self.floating = [joint for joint in robot.joints if joint.type == "floating"]
        self._sent: dict[str, int] = {}

    def forget_times(self) -> None:
        """Discard the published timestamps after the clock has jumped, so that all joints are due again."""
        self._sent.clear()

    def due(self, names: Iterable[str], positions: Iterable[float], stamp: int) -> list[tuple[Joint, Pose]]:
        """Return the poses to publish for a message's joints and the joints that mimic them, sorted by name.

        If the joint with the oldest timestamp is due, all of the message's joints are published; otherwise,
        none are.
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
        # Positions in the message take precedence. Chains of mimic joints are resolved in the same order as
        # in Noetic.
        for _, joint in sorted(self.moving.items()):
            mimic = joint.mimic
            if mimic is not None and mimic.joint in values:
                values.setdefault(joint.name, values[mimic.joint] * mimic.multiplier + mimic.offset)
        return values
