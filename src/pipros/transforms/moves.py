"""Whether a frame has moved far enough to tell of it, as `tf_change_notifier` decides it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import acos, hypot, sqrt
from typing import Any

from pipros.errors import PiprosError
from pipros.transforms.pose import Pose


class BadFramePair(PiprosError, ValueError):
    """A pair of frames, or a distance, is not what the parameter of the node may hold."""


@dataclass
class FramePair:
    """Two frames, and how far the one must move in the other.

    Attributes:
        source, target: the frame that moves, and the frame that it moves in.
        distance: in metres.
        angle: half of the turn, in radians: tf measures the angle between quaternions.
    """

    source: str
    target: str
    distance: float
    angle: float
    _told: Pose | None = field(default=None, init=False)

    def has_moved(self, pose: Pose) -> bool:
        """Whether to tell of a pose: the first, and each that is far from the one that was told last."""
        if self._told is not None and not self._is_far(self._told, pose):
            return False
        self._told = pose
        return True

    def _is_far(self, older: Pose, newer: Pose) -> bool:
        path = hypot(*(b - a for a, b in zip(older[:3], newer[:3], strict=True)))
        return path > self.distance or _angle(older[3:], newer[3:]) > self.angle


def _angle(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """The angle between two quaternions as vectors."""
    lengths = sqrt(sum(a * a for a in one) * sum(b * b for b in other))
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / lengths if lengths else 1.0
    return acos(max(-1.0, min(1.0, cosine)))


def frame_pairs(value: Any, distance: float, angle: float) -> list[FramePair]:
    """The pairs that the parameter `frame_pairs` lists; distances that a pair does not have are these.

    Raises:
        BadFramePair: the value is not a list of such pairs.
    """
    if not isinstance(value, list):
        raise BadFramePair(f"frame_pairs must be a list of pairs, got {value!r}")
    return [_pair(each, distance, angle) for each in value]


def _pair(value: Any, distance: float, angle: float) -> FramePair:
    if not isinstance(value, Mapping):
        raise BadFramePair(f"each of frame_pairs must be a mapping, got {value!r}")
    source, target = (_name(key, value.get(key)) for key in ("source_frame", "target_frame"))
    far = distance_of("translational_update_distance", value.get("translational_update_distance", distance))
    turned = distance_of("angular_update_distance", value.get("angular_update_distance", angle))
    return FramePair(source, target, far, turned)


def _name(key: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise BadFramePair(f"{key} of a frame pair must be the name of a frame, got {value!r}")
    return value


def distance_of(name: str, value: Any) -> float:
    """A distance or an angle.

    Raises:
        BadFramePair: it is not a number, or is below 0.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
        raise BadFramePair(f"{name} must be a number of at least 0, got {value!r}")
    return float(value)
