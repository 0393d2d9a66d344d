"""Read the beams of laser scans in the robot's frame."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np

from pipros.libraries.transforms.pose import Pose, composed, from_roll_pitch_yaw, roll_pitch_yaw
from pipros.navigation.amcl.beams import Beams, read_beams
from pipros.navigation.amcl.settings import Settings
from pipros.navigation.frames import Frames


class ScanReader:
    """Converts scans of one or several lasers. The pose of each laser on the robot is looked up once."""

    def __init__(self, frames: Frames, log: logging.Logger) -> None:
        self._frames, self._log = frames, log
        self._lasers: dict[tuple[str, str], Pose] = {}

    def read(self, message: Any, settings: Settings) -> Beams | None:
        """Return the beams of a scan, or None with a warning if they cannot be used."""
        frame = message.header.frame_id.removeprefix("/")
        key = settings.base_frame_id, frame
        if key not in self._lasers:
            pose = self._frames.latest(*key)
            if pose is None:
                self._log.warning(
                    "no transform from %s to %s: scans are ignored", frame, settings.base_frame_id
                )
                return None
            self._lasers[key] = pose
        pose = self._lasers[key]
        range_min, range_max = message.range_min, message.range_max
        if settings.laser_max_range > 0.0:
            range_max = min(range_max, settings.laser_max_range)
        if settings.laser_min_range > 0.0:
            range_min = max(range_min, settings.laser_min_range)
        if not range_max > 0.0 or not math.isfinite(message.angle_min + message.angle_increment):
            self._log.warning("a scan must have range_max > 0 and finite angles: it is ignored")
            return None
        # Two directions in the robot's frame give the sense of rotation, which an inverted laser reverses.
        first = _bearing(pose, message.angle_min)
        step = math.remainder(_bearing(pose, message.angle_min + message.angle_increment) - first, math.tau)
        bearings = first + step * np.arange(len(message.ranges))
        return read_beams(np.array(message.ranges, float), bearings, pose[:2], range_min, range_max)


def _bearing(laser: Pose, angle: float) -> float:
    """Return the yaw in the robot's frame of a beam at an angle of the laser."""
    turn: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(0.0, 0.0, angle))
    return roll_pitch_yaw(composed(laser, turn))[2]
