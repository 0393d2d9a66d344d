"""Detect frames that have moved far enough to be reported by `tf_change_notifier`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import acos, hypot, inf, sqrt
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_libraries.transforms.pose import Pose


class BadFramePair(PiprosError, ValueError):
    """A parameter that describes frame pairs or distances is invalid."""


@dataclass
class FramePair:
    """A moving frame, its reference frame, and the thresholds for reporting movement.

    Attributes:
        source, target: the moving frame, and the frame relative to which it moves.
        distance: threshold for the translation, in metres.
        angle: threshold for the angle between the quaternions, in radians. As in tf, this is half the
            rotation angle.
    """

    source: str
    target: str
    distance: float
    angle: float
    _reported: Pose | None = field(default=None, init=False)

    def has_moved(self, pose: Pose) -> bool:
        """Return True if `pose` is the first pose, or is far enough from the last reported pose.

        The pose then counts as reported.
        """
        if self._reported is not None and not self._is_far(self._reported, pose):
            return False
        self._reported = pose
        return True

    def _is_far(self, older: Pose, newer: Pose) -> bool:
        path = hypot(*(b - a for a, b in zip(older[:3], newer[:3], strict=True)))
        return path > self.distance or _angle(older[3:], newer[3:]) > self.angle


def _angle(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Return the angle in radians between two quaternions, regarded as four-dimensional vectors."""
    lengths = sqrt(sum(a * a for a in one) * sum(b * b for b in other))
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / lengths if lengths else 1.0
    return acos(max(-1.0, min(1.0, cosine)))


def frame_pairs(value: Any, distance: float, angle: float) -> list[FramePair]:
    """Parse the parameter `frame_pairs`. `distance` and `angle` are the default thresholds.

    Raises:
        BadFramePair: the value is not a list of valid pairs.
    """
    if not isinstance(value, list):
        raise BadFramePair(f"frame_pairs must be a list of mappings, got {value!r}")
    return [_pair(each, distance, angle) for each in value]


def _pair(value: Any, distance: float, angle: float) -> FramePair:
    if not isinstance(value, Mapping):
        raise BadFramePair(f"each element of frame_pairs must be a mapping, got {value!r}")
    source, target = (_name(key, value.get(key)) for key in ("source_frame", "target_frame"))
    far = distance_of("translational_update_distance", value.get("translational_update_distance", distance))
    turn = distance_of("angular_update_distance", value.get("angular_update_distance", angle))
    return FramePair(source, target, far, turn)


def _name(key: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise BadFramePair(f"{key} of a frame pair must be a frame ID, got {value!r}")
    return value


def distance_of(name: str, value: Any) -> float:
    """Parse a distance or an angle.

    Raises:
        BadFramePair: the value is not a number >= 0.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
        raise BadFramePair(f"{name} must be a number >= 0, got {value!r}")
    return float(value)


def frequency_of(name: str, value: Any) -> float:
    """Parse a frequency in Hz.

    Raises:
        BadFramePair: the value is not a finite number > 0.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < inf:
        raise BadFramePair(f"{name} must be a finite number > 0, got {value!r}")
    return float(value)
