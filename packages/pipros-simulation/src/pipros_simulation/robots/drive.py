"""Motion of a robot on wheels.

Poses are x and y in metres and the yaw in radians, counter-clockwise from x. At constant velocities, a robot
follows an arc, which is computed in closed form, so the size of a step does not affect the accuracy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose in the plane; the yaw is between -pi and pi."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion along an arc: the distances in metres, and the turn in radians, at constant rates.

    Attributes:
        sideways: the distance to the left, which only omnidirectional bases drive.
    """

    forwards: float = 0.0
    turn: float = 0.0
    sideways: float = 0.0

    def times(self, factor: float) -> Motion:
        """Return the motion in another time."""
        return Motion(self.forwards * factor, self.turn * factor, self.sideways * factor)

    def wheels(self, separation: float, radius: float) -> tuple[float, float]:
        """Return the angles, in radians, by which the left and the right wheel turn."""
        half = self.turn * separation / 2
        return (self.forwards - half) / radius, (self.forwards + half) / radius


def moved(pose: Pose, motion: Motion) -> Pose:
    """Return the pose at the end of an arc that begins at `pose`."""
    half = motion.turn / 2
    # The chord of the arc; the mean of the first and the last yaw turns it.
    chord = math.sin(half) / half if half else 1.0
    forwards, sideways = chord * motion.forwards, chord * motion.sideways
    cosine, sine = math.cos(pose.yaw + half), math.sin(pose.yaw + half)
    return Pose(
        pose.x + forwards * cosine - sideways * sine,
        pose.y + forwards * sine + sideways * cosine,
        wrapped(pose.yaw + motion.turn),
    )


def wrapped(angle: float) -> float:
    """Return the equivalent angle between -pi and pi."""
    return math.remainder(angle, math.tau)


def relative(origin: Pose, pose: Pose) -> Pose:
    """Convert `pose` to the frame at `origin`; both are given in the same frame."""
    cosine, sine = math.cos(origin.yaw), math.sin(origin.yaw)
    x, y = pose.x - origin.x, pose.y - origin.y
    return Pose(cosine * x + sine * y, cosine * y - sine * x, wrapped(pose.yaw - origin.yaw))


def combined(first: Pose, second: Pose) -> Pose:
    """Convert `second`, a pose relative to `first`, to the frame in which `first` is given."""
    cosine, sine = math.cos(first.yaw), math.sin(first.yaw)
    return Pose(
        first.x + cosine * second.x - sine * second.y,
        first.y + sine * second.x + cosine * second.y,
        wrapped(first.yaw + second.yaw),
    )
