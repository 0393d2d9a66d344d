"""Decide when to move, weight and resample the particles. This module performs no I/O."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipros.navigation.amcl.grid import Array, GridMap
from pipros.navigation.amcl.motion import moved
from pipros.navigation.amcl.particles import ParticleFilter
from pipros.navigation.amcl.sensors import Beams, sensor_model
from pipros.navigation.amcl.settings import AmclSettings, Belief
from pipros.navigation.plane import Triple


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate of the robot's pose.

    Attributes:
        pose: the mean of the heaviest cluster.
        covariance: the covariance of all particles, shape (3, 3).
    """

    pose: Triple
    covariance: Array


@dataclass(frozen=True, slots=True)
class ScanOutcome:
    """The result of a scan: whether to publish the particles, and the new estimate, if any."""

    is_updated: bool
    estimate: Estimate | None = None


class Localizer:
    """Monte Carlo localisation on one map. Not thread-safe."""

    def __init__(
        self, grid: GridMap, settings: AmclSettings, belief: Belief, rng: np.random.Generator
    ) -> None:
        """Draw the particles around `belief`."""
        self._grid, self._settings, self._rng = grid, settings, rng
        self._sensor = sensor_model(grid, settings)
        self.particles = ParticleFilter(settings, rng)
        self._is_forced = False
        self._updates = 0
        self._pending: dict[str, bool] = {}
        self.start_at(belief)

    def start_at(self, belief: Belief) -> None:
        """Redraw the particles from a normal distribution."""
        covariance = np.diag((belief.xx, belief.yy, belief.aa))
        covariance[0, 1] = covariance[1, 0] = belief.xy
        self.particles.spread_normally(np.array((belief.x, belief.y, belief.yaw)), covariance)
        self._odometry: Triple | None = None

    def start_anywhere(self) -> None:
        """Spread the particles over all free cells."""
        self.particles.spread(self._grid.random_poses(self._settings.max_particles, self._rng))
        self._odometry = None

    def force_update(self) -> None:
        """Use the next scan for an update, even if the robot has not moved."""
        self._is_forced = True

    def scan(self, laser: str, odometry: Triple, beams: Beams) -> ScanOutcome:
        """Update the particles with a scan, if an update is due.

        An update is due at the first scan, after a motion of more than `update_min_d` or `update_min_a`, and
        after `force_update`. For each update, one scan of every laser is used.

        Args:
            laser: name of the laser.
            odometry: pose of the robot in the odometry frame when the scan was taken.
        """
        settings, particles, before = self._settings, self.particles, self._odometry
        self._pending.setdefault(laser, True)
        if before is None:
            self._updates = 0
            self._pending = dict.fromkeys(self._pending, True)
        else:
            turn = math.remainder(odometry[2] - before[2], math.tau)
            shift = max(abs(odometry[0] - before[0]), abs(odometry[1] - before[1]))
            if shift > settings.update_min_d or abs(turn) > settings.update_min_a or self._is_forced:
                self._pending = dict.fromkeys(self._pending, True)
            self._is_forced = False
            if not self._pending[laser]:
                return ScanOutcome(is_updated=False)
            particles.poses = moved(
                settings.odom_model_type, particles.poses, before, odometry, settings.alphas, self._rng
            )
        if settings.laser_max_beams >= 2:
            used = beams.chosen(settings.laser_model_type, settings.laser_max_beams)
            factors = self._sensor.factors(particles.poses, used, has_converged=particles.has_converged)
            particles.weigh(factors)
        self._pending[laser] = False
        self._odometry = odometry
        self._updates += 1
        is_resampled = self._updates % settings.resample_interval == 0
        if is_resampled:
            particles.resample(self._grid.random_poses)
        estimate = None
        if before is None or is_resampled:
            estimate = Estimate(particles.heaviest_cluster()[1], particles.covariance())
        # As in amcl, a first update does not publish the cloud if a forced update will follow.
        return ScanOutcome(not self._is_forced, estimate)
