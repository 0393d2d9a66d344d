"""The particle filter: weights, clusters, and resampling with an adaptive number of particles.

- Augmented Monte Carlo localisation (random particles when the measurements get worse): Probabilistic
  Robotics, table 8.3.
- KLD sampling: D. Fox, Adapting the Sample Size in Particle Filters Through KLD-Sampling, International
  Journal of Robotics Research 22 (2003), equation 7; Probabilistic Robotics, table 8.4.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.amcl.grid import Array
from pipros_robot.navigation.amcl.settings import AmclSettings
from pipros_robot.navigation.plane import Triple

Labels = NDArray[np.int64]

BIN: Final = np.array((0.5, 0.5, np.radians(10.0)))
"""Size of a bin of the histogram: metres, metres, radians."""
CONVERGED_M: Final = 0.5
"""The filter has converged if no particle is farther than this from the mean in x or in y."""

_NEIGHBOURS: Final = np.array([step for step in product((-1, 0, 1), repeat=3) if step > (0, 0, 0)])
"""Half of the 26 steps to neighbours; the other half are their opposites."""


class ParticleFilter:
    """A set of weighted poses. Not thread-safe.

    Attributes:
        poses: shape (n, 3).
        weights: shape (n,); their sum is 1.
        has_converged: see `CONVERGED_M`; computed by `resample`.
    """

    def __init__(self, settings: AmclSettings, rng: np.random.Generator) -> None:
        self._settings, self._rng = settings, rng
        self._slow = self._fast = 0.0
        self.poses = np.zeros((1, 3))
        self.weights = np.ones(1)
        self.has_converged = False

    def spread(self, poses: Array) -> None:
        """Replace all particles with these poses, which get equal weights."""
        self._set(poses)
        self._slow = self._fast = 0.0
        self.has_converged = False

    def spread_normally(self, mean: Array, covariance: Array) -> None:
        """Draw the maximum number of particles from a normal distribution (shapes (3,) and (3, 3))."""
        variances, axes = np.linalg.eigh(covariance)
        deviations = np.sqrt(np.maximum(variances, 0.0))
        drawn = self._rng.normal(size=(self._settings.max_particles, 3)) * deviations
        self.spread(mean + drawn @ axes.T)

    def weigh(self, factors: Array) -> None:
        """Multiply the weights by the likelihoods of a measurement, and normalize them.

        If all products are 0, the weights become equal.
        """
        weights = self.weights * factors
        total = float(weights.sum())
        if not total > 0.0:
            self.weights = np.full(len(weights), 1.0 / len(weights))
            return
        self.weights = weights / total
        average, settings = total / len(weights), self._settings
        self._slow += settings.recovery_alpha_slow * (average - self._slow) if self._slow else average
        self._fast += settings.recovery_alpha_fast * (average - self._fast) if self._fast else average

    def resample(self, random_poses: Callable[[int, np.random.Generator], Array]) -> None:
        """Draw new particles by weight, and some random ones if the measurements have become unlikely.

        With `selective_resampling`, do this only if at most half of the particles are effective.
        """
        settings, count = self._settings, self._settings.max_particles
        if settings.selective_resampling and 1.0 / float((self.weights**2).sum()) > 0.5 * len(self.weights):
            return
        share = max(0.0, 1.0 - self._fast / self._slow) if self._slow else 0.0
        ends = np.cumsum(self.weights)
        chosen = np.searchsorted(ends, self._rng.random(count) * ends[-1], side="right")
        drawn = self.poses[np.minimum(chosen, len(ends) - 1)]
        if share > 0.0:
            is_random = self._rng.random(count) < share
            drawn[is_random] = random_poses(int(is_random.sum()), self._rng)
            self._slow = self._fast = 0.0
        _, first = np.unique(_bins(drawn)[0], return_index=True)
        is_new = np.zeros(count, np.int64)
        is_new[first] = 1
        limits = kld_limits(np.cumsum(is_new), settings)
        enough = np.flatnonzero(np.arange(1, count + 1) > limits)
        self._set(drawn[: enough[0] + 1] if enough.size else drawn)
        offsets = abs(self.poses[:, :2] - self.poses[:, :2].mean(axis=0))
        self.has_converged = bool((offsets <= CONVERGED_M).all())

    def _set(self, poses: Array) -> None:
        self.poses = poses
        self.weights = np.full(len(poses), 1.0 / len(poses))

    def covariance(self) -> Array:
        """Return the covariance of x and y, and the variance of yaw, of all particles; shape (3, 3).

        The variance of the yaw is that of a wrapped normal distribution: -2 ln R, where R is the length of
        the mean of the unit vectors.
        """
        found = np.zeros((3, 3))
        position = self.poses[:, :2]
        mean = self.weights @ position
        found[:2, :2] = (position * self.weights[:, None]).T @ position - np.outer(mean, mean)
        length = abs(np.sum(self.weights * np.exp(1j * self.poses[:, 2])))
        found[2, 2] = -2.0 * np.log(min(max(length, 1e-300), 1.0))
        return found

    def heaviest_cluster(self) -> tuple[float, Triple]:
        """Return the weight and mean pose of the heaviest cluster of particles in adjacent bins."""
        codes, scale = _bins(self.poses)
        distinct, member = np.unique(codes, return_inverse=True)
        label = _connected(distinct, scale)[member]
        totals = np.bincount(label, self.weights)
        heaviest = int(totals.argmax())
        inside = label == heaviest
        weights, poses = self.weights[inside], self.poses[inside]
        x, y = (weights @ poses[:, :2] / totals[heaviest]).tolist()
        yaw = float(np.arctan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2])))
        return float(totals[heaviest]), (x, y, yaw)


def kld_limits(occupied: Labels, settings: AmclSettings) -> Array:
    """Return the required number of particles for each number of occupied bins, within the limits.

    For k bins, the error e and the quantile z, the number is
    (k - 1) / 2e * (1 - 2 / (9 (k - 1)) + z * sqrt(2 / (9 (k - 1))))³. Like amcl, this uses `kld_z` as the
    quantile, although users set it to the desired confidence, such as 0.99. For a single bin, or if `kld_err`
    is not > 0, the number is `max_particles`.
    """
    if settings.kld_err <= 0.0:
        return np.full(len(occupied), float(settings.max_particles))
    free = np.maximum(occupied - 1, 1).astype(float)
    part = 2.0 / (9.0 * free)
    count = np.ceil(free / (2.0 * settings.kld_err) * (1.0 - part + np.sqrt(part) * settings.kld_z) ** 3)
    limited: Array = np.clip(count, settings.min_particles, settings.max_particles)
    return np.where(occupied <= 1, float(settings.max_particles), limited)


def _bins(poses: Array) -> tuple[Labels, Labels]:
    """Return the code of each pose's bin, and how much codes differ between neighbours along each axis."""
    # As in amcl, yaws are not wrapped, so that particles that turn past pi together stay together.
    bins = np.floor(poses / BIN).astype(np.int64)
    low = bins.min(axis=0) - 1
    _, width, depth = (bins.max(axis=0) + 2 - low).tolist()
    scale = np.array((width * depth, depth, 1))
    return (bins - low) @ scale, scale


def _connected(codes: Labels, scale: Labels) -> Labels:
    """Return the label of the connected component of each bin. `codes` are sorted and distinct."""
    wanted = codes + (_NEIGHBOURS @ scale)[:, None]
    place = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
    step, one = np.nonzero(codes[place] == wanted)
    other = place[step, one]
    label: Labels = np.arange(len(codes))
    while True:  # each round spreads the smallest label to neighbours, then follows labels to their ends
        smallest = np.minimum(label[one], label[other])
        before = label.copy()
        np.minimum.at(label, label[one], smallest)
        np.minimum.at(label, label[other], smallest)
        label = label[label]
        if np.array_equal(before, label):
            return label
