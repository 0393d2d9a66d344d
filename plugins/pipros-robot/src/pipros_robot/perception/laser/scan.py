"""A laser scan for filters, with ranges and intensities as arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import LaserScan

    from pipros_libraries.vision.extras import Array

_LONGEST_SCAN_S: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Scan:
    """The fields of a `sensor_msgs/LaserScan`. Filters return copies and never change the arrays.

    Attributes:
        ranges, intensities: float32 arrays. There may be fewer intensities than ranges.
    """

    frame: str
    stamp_ns: int
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: Array
    intensities: Array

    @classmethod
    def of(cls, message: LaserScan) -> Scan:
        """Convert a message to a scan."""
        return cls(
            message.header.frame_id,
            in_ns(message.header.stamp),
            message.angle_min,
            message.angle_max,
            message.angle_increment,
            message.time_increment,
            message.scan_time,
            message.range_min,
            message.range_max,
            np.array(message.ranges, np.float32),
            np.array(message.intensities, np.float32),
        )

    def message(self) -> LaserScan:
        """Convert the scan to a message."""
        made: LaserScan = load_message_class("sensor_msgs/LaserScan")()
        for name in made.__slots__:
            if name != "header":
                setattr(made, name, getattr(self, name))
        made.header.frame_id, made.header.stamp = self.frame, Time(*divmod(self.stamp_ns, NS_PER_S))
        return made

    def with_ranges(self, ranges: Array) -> Scan:
        """Return a copy with other ranges, which are converted to float32."""
        with np.errstate(over="ignore"):
            return replace(self, ranges=np.asarray(ranges).astype(np.float32))

    def without(self, beams: Array | slice) -> Scan:
        """Return a copy in which the ranges of the given beams (a mask or indices) are NaN."""
        ranges = self.ranges.copy()
        ranges[beams] = np.nan
        return replace(self, ranges=ranges)

    def cleared(self, beams: Array) -> Scan:
        """Return a copy in which the masked beams have the range `range_max` + 1 and the intensity 0."""
        ranges, intensities = self.ranges.copy(), self.intensities.copy()
        ranges[beams] = np.float32(self.range_max + 1.0)
        intensities[beams[: len(intensities)].nonzero()[0]] = 0.0
        return replace(self, ranges=ranges, intensities=intensities)

    def summed_angles(self) -> Array:
        """Return the beams' angles in float64, computed by repeated addition as in the C++ filters."""
        steps = np.full(len(self.ranges) + 1, self.angle_increment)
        steps[0] = self.angle_min
        return np.add.accumulate(steps)[: len(self.ranges)]

    def angles32(self) -> Array:
        """Return the beams' angles as float64, each computed from its index in float32."""
        beams = np.arange(len(self.ranges), dtype=np.float32)
        angles = np.float32(self.angle_min) + beams * np.float32(self.angle_increment)
        return angles.astype(np.float64)

    def beam_stamp_ns(self, index: int) -> int:
        """Return the time at which a beam was measured. The offset is computed in float32."""
        with np.errstate(all="ignore"):
            after_s = float(np.float32(index) * np.float32(self.time_increment))
        return self.stamp_ns + _duration_ns(after_s)

    def stamp_of_cut(self, count: int) -> int:
        """Return the timestamp of the scan without its first `count` beams, rounded as in the C++ filters."""
        return self.stamp_ns + count * _duration_ns(self.time_increment)


def _duration_ns(seconds: float) -> int:
    """Convert seconds to nanoseconds. Return 0 if the time is too long for a scan."""
    return round(seconds * NS_PER_S) if abs(seconds) < _LONGEST_SCAN_S else 0
