"""Decide when to move, weight and resample the particles. This module performs no I/O.

One motion model is `sample_motion_model_odometry` of Probabilistic Robotics, table 5.6, for robots that turn
and drive; the other is for robots that also move sideways. The alphas are the parameters `odom_alpha1` to
`odom_alpha5`. The models without `-corrected` use the book's variances as standard deviations, because the
alphas of existing robots are tuned for these models.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pipros_robot.navigation.amcl.grid import Array, GridMap
from pipros_robot.navigation.amcl.particles import ParticleFilter
from pipros_robot.navigation.amcl.sensors import Beams, sensor_model
from pipros_robot.navigation.amcl.settings import AmclSettings, Belief
from pipros_robot.navigation.plane import Poses, Triple


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


SHORTEST_M: Final = 0.01
"""The direction of a shorter motion is unknown, so the model assumes no turn before it."""


def moved(
    model: str,
    particles: Poses,
    before: Triple,
    after: Triple,
    alphas: Sequence[float],
    rng: np.random.Generator,
) -> Poses:
    """Return the particles after a motion from one odometry pose to another.

    Args:
        model: `diff`, `omni`, `diff-corrected` or `omni-corrected`.
        particles: poses, shape (n, 3). The resulting yaws are not wrapped.
        before, after: poses of the robot in the odometry frame.
        alphas: five noise parameters.
    """
    is_corrected = model.endswith("-corrected")

    def draw(spread: float) -> Any:
        return rng.normal(0.0, math.sqrt(spread) if is_corrected else spread, len(particles))

    dx, dy = after[0] - before[0], after[1] - before[1]
    distance, turn = math.hypot(dx, dy), _wrapped(after[2] - before[2])
    bearing = _wrapped(math.atan2(dy, dx) - before[2])
    a1, a2, a3, a4, a5 = alphas
    x, y, yaw = particles.T
    if model.startswith("diff"):
        turn1 = 0.0 if distance < SHORTEST_M else bearing
        turn2 = _wrapped(turn - turn1)
        noisy1, noisy2 = _from_straight(turn1), _from_straight(turn2)
        direction = yaw + turn1 - draw(a1 * noisy1**2 + a2 * distance**2)
        along = distance - draw(a3 * distance**2 + a4 * (noisy1**2 + noisy2**2))
        turned = direction + turn2 - draw(a1 * noisy2**2 + a2 * distance**2)
        across: Any = 0.0
    else:
        if not is_corrected:  # this model swaps the meanings of these two alphas
            a1, a4 = a4, a1
        direction = yaw + bearing
        along = distance + draw(a3 * distance**2 + a4 * turn**2)
        turned = yaw + turn + draw(a1 * turn**2 + a2 * distance**2)
        across = draw(a4 * turn**2 + a5 * distance**2)
    cosine, sine = np.cos(direction), np.sin(direction)
    return np.stack((x + along * cosine + across * sine, y + along * sine - across * cosine, turned), axis=1)


def _wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)


def _from_straight(turn: float) -> float:
    """Return the angle from straight ahead or straight back, whichever is nearer.

    Thus, driving straight back adds no rotational noise.
    """
    return min(abs(_wrapped(turn)), abs(_wrapped(turn - math.pi)))
