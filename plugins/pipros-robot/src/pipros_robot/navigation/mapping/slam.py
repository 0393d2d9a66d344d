"""Grid-based FastSLAM: each particle has a trajectory and a map, and moves by odometry and scan matching.

See the paper by Grisetti, Stachniss and Burgard (2007), sections III and IV: a proposal improved by scan
matching, and resampling only when the effective number of particles (its equation 20) is small.
"""

from __future__ import annotations

import math

import numpy as np

from pipros.basics.intervals import elapsed
from pipros_robot.navigation.mapping.hit_maps import Array, HitMaps
from pipros_robot.navigation.mapping.matching import ScanMatcher
from pipros_robot.navigation.mapping.settings import MappingSettings
from pipros_robot.navigation.mapping.survey import TrajectoryStep
from pipros_robot.navigation.plane import Triple


class GridSlam:
    """Builds maps from scans of one laser. Not thread-safe.

    Attributes:
        poses: the laser's pose for each particle, shape (n, 3).
        steps: the last step of each particle's trajectory.
    """

    def __init__(
        self, settings: MappingSettings, angles: Array, start: Triple, rng: np.random.Generator
    ) -> None:
        """Start all particles at the laser's pose in the odometry frame."""
        count = settings.particles
        self._settings, self._angles, self._rng = settings, angles, rng
        self._matcher = ScanMatcher(settings, angles)
        self._maps = HitMaps(count, settings.delta)
        self.poses = np.tile(np.array(start), (count, 1))
        self.steps: list[TrajectoryStep | None] = [None] * count
        self._odometry = start
        self._logs = np.zeros(count)
        self._totals = np.zeros(count)
        self._distance = self._turn = 0.0
        self._processed_s: float | None = None

    @property
    def best(self) -> int:
        """The index of the particle whose scans have the greatest likelihood."""
        return int(self._totals.argmax())

    def entropy(self) -> float:
        """Return -sum(w ln w), where w are the logarithmic weights divided by their sum, as in gmapping."""
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = self._logs / self._logs.sum()
            return float(-(shares * np.log(shares)).sum())

    def scan(self, odometry: Triple, ranges: Array, time_s: float) -> bool:
        """Move the particles. Process the scan if it is the first, or after enough motion or time.

        Args:
            odometry: pose of the laser in the odometry frame.
            ranges: ranges in metres, one per angle.

        Returns:
            Whether the scan was processed.
        """
        settings = self._settings
        self._move(odometry)
        if self._processed_s is not None:
            is_due = self._distance >= settings.linearUpdate or self._turn >= settings.angularUpdate
            if not is_due and not 0.0 <= settings.temporalUpdate < elapsed(time_s, self._processed_s):
                return False
            self.poses, logs = self._matcher.match(self._maps, self.poses, ranges)
            self._logs += logs
            self._totals += logs
        self._processed_s, self._distance, self._turn = time_s, 0.0, 0.0
        poses = map(tuple, self.poses.tolist())
        self.steps = [
            TrajectoryStep(pose, ranges, parent) for pose, parent in zip(poses, self.steps, strict=True)
        ]
        self._resample()
        self._register(ranges)
        return True

    def try_match(self, ranges: Array) -> None:
        """Match a scan and discard the result, to measure how long matching takes."""
        self._matcher.match(self._maps, self.poses + np.array((0.1, 0.1, 0.1)), ranges)

    def _move(self, odometry: Triple) -> None:
        """Move the particles by the motion of the odometry, with noise in each particle's frame."""
        settings, (x, y, yaw) = self._settings, self._odometry
        east, north, turn = odometry[0] - x, odometry[1] - y, math.remainder(odometry[2] - yaw, math.tau)
        along = math.cos(yaw) * east + math.sin(yaw) * north
        across = math.cos(yaw) * north - math.sin(yaw) * east
        distance, aside = math.hypot(along, across), 0.3 * settings.srr
        self._odometry = odometry
        self._distance += distance
        self._turn += abs(turn)
        spread = (
            settings.srr * abs(along) + settings.str * abs(turn) + aside * abs(across),
            settings.srr * abs(across) + settings.str * abs(turn) + aside * abs(along),
            settings.stt * abs(turn) + settings.srt * distance,
        )
        moves = self._rng.normal((along, across, turn), spread, (len(self.poses), 3))
        cosine, sine = np.cos(self.poses[:, 2]), np.sin(self.poses[:, 2])
        self.poses[:, 0] += cosine * moves[:, 0] - sine * moves[:, 1]
        self.poses[:, 1] += sine * moves[:, 0] + cosine * moves[:, 1]
        self.poses[:, 2] = np.remainder(self.poses[:, 2] + moves[:, 2] + math.pi, math.tau) - math.pi

    def _resample(self) -> None:
        """Resample systematically if the effective number of particles is small."""
        count = len(self.poses)
        weights = np.exp((self._logs - self._logs.max()) / (self._settings.ogain * count))
        weights /= weights.sum()
        if 1.0 / float((weights**2).sum()) >= self._settings.resampleThreshold * count:
            return
        places = (np.arange(count) + self._rng.random()) / count
        chosen = np.minimum(np.searchsorted(np.cumsum(weights), places), count - 1)
        self.poses, self._totals = self.poses[chosen], self._totals[chosen]
        self.steps = [self.steps[index] for index in chosen.tolist()]
        self._maps.resample(chosen)
        self._logs = np.zeros(count)

    def _register(self, ranges: Array) -> None:
        is_used = (ranges > 0.0) & (ranges <= min(self._settings.maxRange, self._settings.maxUrange))
        angles = self.poses[:, 2:] + self._angles[is_used]
        self._maps.add(
            self.poses[:, :1] + ranges[is_used] * np.cos(angles),
            self.poses[:, 1:2] + ranges[is_used] * np.sin(angles),
        )
