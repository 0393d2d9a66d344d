"""Localisation of a robot: decides when the particle filter moves, weighs and resamples. Performs no I/O."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipros.navigation.amcl.beam import BeamMixture, BeamModel
from pipros.navigation.amcl.beams import Beams
from pipros.navigation.amcl.field import Hits, LikelihoodField, LikelihoodProduct, Skipping
from pipros.navigation.amcl.grid import GridMap
from pipros.navigation.amcl.motion import Pose2, angle_between, moved
from pipros.navigation.amcl.particles import ParticleFilter, Sampling
from pipros.navigation.amcl.settings import Belief, Settings

Array = NDArray[np.float64]


class SensorModel(Protocol):
    """Returns the factor for the weight of each particle."""

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array: ...


@dataclass(frozen=True, slots=True)
class Estimate:
    """The pose of the robot in the map, the mean of the heaviest cluster.

    Attributes:
        covariance: that of all particles, shape (3, 3).
    """

    pose: Pose2
    covariance: Array


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a scan has changed: whether the weights are new, and the new estimate, if any."""

    is_updated: bool
    estimate: Estimate | None = None


class Localizer:
    """Monte Carlo localisation on one map. Not thread-safe."""

    def __init__(self, grid: GridMap, settings: Settings, belief: Belief, rng: np.random.Generator) -> None:
        """Draw the particles around `belief`."""
        self._grid, self._settings, self._rng = grid, settings, rng
        self._sensor = _sensor(grid, settings)
        sampling = Sampling(
            settings.min_particles,
            settings.max_particles,
            settings.kld_err,
            settings.kld_z,
            settings.recovery_alpha_slow,
            settings.recovery_alpha_fast,
            settings.selective_resampling,
        )
        self.particles = ParticleFilter(sampling, rng)
        self._is_forced = False
        self._updates = 0
        self._odometry: Pose2 | None = None
        self._pending: dict[str, bool] = {}
        self.start_at(belief)

    def start_at(self, belief: Belief) -> None:
        """Draw the particles anew from a normal distribution."""
        covariance = np.diag((belief.xx, belief.yy, belief.aa))
        covariance[0, 1] = covariance[1, 0] = belief.xy
        self.particles.spread_normally(np.array((belief.x, belief.y, belief.yaw)), covariance)
        self._odometry = None

    def start_anywhere(self) -> None:
        """Spread the particles over all free cells."""
        self.particles.spread(self._grid.random_poses(self._settings.max_particles, self._rng))
        self._odometry = None

    def force_update(self) -> None:
        """Update with the next scan, even if the robot has not moved."""
        self._is_forced = True

    def scan(self, laser: str, odometry: Pose2, beams: Beams) -> Outcome:
        """Update the particles with a scan, if it is the first or the robot has moved far enough.

        After that motion, each laser contributes one scan.

        Args:
            laser: name of the laser.
            odometry: pose of the robot in the odometry frame when the scan was taken.
        """
        settings = self._settings
        self._pending.setdefault(laser, True)
        is_first = self._odometry is None
        if self._odometry is None:
            self._updates = 0
            self._odometry = odometry
            self._pending = dict.fromkeys(self._pending, True)
        else:
            dx, dy = odometry[0] - self._odometry[0], odometry[1] - self._odometry[1]
            turn = angle_between(odometry[2], self._odometry[2])
            is_far = max(abs(dx), abs(dy)) > settings.update_min_d or abs(turn) > settings.update_min_a
            if is_far or self._is_forced:
                self._pending = dict.fromkeys(self._pending, True)
            self._is_forced = False
            if not self._pending[laser]:
                return Outcome(is_updated=False)
            particles = self.particles
            particles.poses = moved(
                settings.odom_model_type,
                particles.poses,
                self._odometry,
                odometry,
                settings.alphas,
                self._rng,
            )
        self._weigh(beams)
        self._pending[laser] = False
        self._odometry = odometry
        self._updates += 1
        is_resampled = self._updates % settings.resample_interval == 0
        if is_resampled:
            self.particles.resample(self._grid.random_poses)
        has_estimate = is_first or is_resampled
        # As in amcl, the cloud is published by the forced update that follows, not by the first one.
        return Outcome(not self._is_forced, self.estimate() if has_estimate else None)

    def _weigh(self, beams: Beams) -> None:
        settings = self._settings
        if settings.laser_max_beams < 2:
            return
        used = beams.chosen(settings.laser_model_type, settings.laser_max_beams)
        particles = self.particles
        particles.weigh(self._sensor.factors(particles.poses, used, has_converged=particles.has_converged))

    def estimate(self) -> Estimate:
        """Return the current estimate."""
        return Estimate(self.particles.heaviest_cluster().pose, self.particles.covariance())


def _sensor(grid: GridMap, settings: Settings) -> SensorModel:
    if settings.laser_model_type == "beam":
        return BeamModel(
            grid,
            BeamMixture(
                settings.laser_z_hit,
                settings.laser_z_short,
                settings.laser_z_max,
                settings.laser_z_rand,
                settings.laser_sigma_hit,
                settings.laser_lambda_short,
            ),
        )
    hits = Hits(settings.laser_z_hit, settings.laser_z_rand, settings.laser_sigma_hit)
    if settings.laser_model_type == "likelihood_field":
        return LikelihoodField(grid, hits, settings.laser_likelihood_max_dist)
    skipping = Skipping(
        settings.beam_skip_distance, settings.beam_skip_threshold, settings.beam_skip_error_threshold
    )
    return LikelihoodProduct(
        grid,
        hits,
        settings.laser_likelihood_max_dist,
        settings.laser_max_beams,
        skipping if settings.do_beamskip else None,
    )
