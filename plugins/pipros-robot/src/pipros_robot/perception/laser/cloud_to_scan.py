"""Convert the points of a cloud between two heights to a laser scan, as in pointcloud_to_laserscan 1.4."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

BEAMS_LIMIT = 1_000_000
"""Maximum number of beams in a scan."""


class InvalidScanSettings(PiprosError, ValueError):
    """The angles do not result in a valid number of beams. The text contains the angles."""


@dataclass(frozen=True, slots=True)
class CloudToScan:
    """Converts points to ranges. Settings have the names and defaults of the genuine parameters.

    Attributes:
        min_height: minimum z of points. As in the original, the default is the smallest positive normal
            number, so points at z = 0 are dropped.
        use_inf: whether the range of beams without a point is infinity; otherwise, it is
            `range_max + inf_epsilon`.
    """

    min_height: float = sys.float_info.min
    max_height: float = sys.float_info.max
    angle_min: float = -math.pi
    angle_max: float = math.pi
    angle_increment: float = math.pi / 180.0
    scan_time: float = 1.0 / 30.0
    range_min: float = 0.0
    range_max: float = sys.float_info.max
    use_inf: bool = True
    inf_epsilon: float = 1.0

    def beams(self) -> int:
        """Return the number of beams, computed from the float32 values in the message.

        Raises:
            InvalidScanSettings: the result is not a number from 0 to `BEAMS_LIMIT`.
        """
        low, high, step = self._angles()
        with np.errstate(all="ignore"):
            count = float(np.ceil((high - low) / step))
        if not 0 <= count <= BEAMS_LIMIT:
            raise InvalidScanSettings(
                f"angle_min {self.angle_min:g}, angle_max {self.angle_max:g} and angle_increment "
                f"{self.angle_increment:g} must give 0 to {BEAMS_LIMIT} beams, got {count:g}"
            )
        return int(count)

    def _angles(self) -> Array:
        """Return the first and last angle and the increment as float32, their type in the message."""
        return np.array([self.angle_min, self.angle_max, self.angle_increment], np.float32)

    def ranges(self, points: Array) -> Array:
        """Return the distance of the nearest point in each beam as float32.

        Args:
            points: x, y and z in the scan's frame, a float32 array of shape (n, 3).
        """
        low, high, step = self._angles()
        with np.errstate(over="ignore"):
            empty = np.inf if self.use_inf else np.float64(np.float32(self.range_max)) + self.inf_epsilon
            ranges = np.full(self.beams(), empty, np.float32)
        with np.errstate(invalid="ignore"):
            x, y, z = points.astype(np.float64).T
            kept = (z >= self.min_height) & (z <= self.max_height) & ~np.isnan(x) & ~np.isnan(y)
            x, y = x[kept], y[kept]
            distances = np.hypot(x, y)
            angles = np.arctan2(y, x)
            kept = (distances >= self.range_min) & (distances <= self.range_max)
            kept &= (angles >= low) & (angles <= high)
            beams = ((angles[kept] - low) / step).astype(np.int64)
        inside = beams < len(ranges)
        np.minimum.at(ranges, beams[inside], distances[kept][inside].astype(np.float32))
        return ranges
