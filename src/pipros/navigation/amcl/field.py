"""Likelihood fields: score beams by the distance from their ends to the nearest obstacle of the map.

See Probabilistic Robotics, table 6.3. With the distance d, a beam has the probability
`z_hit * exp(-d² / (2 sigma_hit²)) + z_rand / range_max`. It depends only on the cell in which the beam ends,
so it is computed once for each cell of the map.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipros.navigation.amcl.beams import SMALLEST_SIGMA, Beams
from pipros.navigation.amcl.grid import GridMap

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hits:
    """Parameters of a likelihood field: weights of both terms, and the standard deviation in metres."""

    z_hit: float
    z_rand: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Skipping:
    """Parameters of beam skipping: distance in metres, and shares of particles and of beams."""

    distance: float
    threshold: float
    error_threshold: float


class LikelihoodField:
    """The model `likelihood_field`: as amcl, it adds the cubes of the probabilities of all beams."""

    def __init__(self, grid: GridMap, hits: Hits, max_distance: float) -> None:
        """Compute the field; distances above `max_distance` (metres), and outside the map, count as it."""
        self._grid = grid
        self._hits = hits
        self.distances = grid.obstacle_distances(max_distance)
        self._table = lru_cache(maxsize=2)(self._make_table)

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:  # noqa: ARG002
        """Return the factor for the weight of each particle: 1 + the sum of the cubes."""
        used = beams.short()
        x, y = used.end_points(particles)
        found: Array = 1.0 + self._grid.look_up(self._table(beams.range_max), x, y).sum(axis=1)
        return found

    def _probabilities(self, range_max: float) -> Array:
        nearness: Array = np.exp(-(self.distances**2) / (2.0 * max(self._hits.sigma, SMALLEST_SIGMA) ** 2))
        return self._hits.z_hit * nearness + self._hits.z_rand / range_max

    def _make_table(self, range_max: float) -> Array:
        cubes: Array = self._probabilities(range_max) ** 3
        return cubes


class LikelihoodProduct(LikelihoodField):
    """The model `likelihood_field_prob`: the product of the probabilities of all beams.

    With `skipping`, and if the filter has converged, beams are left out that end near an obstacle for only a
    few of the particles, such as beams that hit people. If these are most of the beams, all are used.
    """

    def __init__(
        self, grid: GridMap, hits: Hits, max_distance: float, max_beams: int, skipping: Skipping | None
    ) -> None:
        """Compute the field. `max_beams` is the number of beams to which `error_threshold` refers."""
        super().__init__(grid, hits, max_distance)
        self._max_beams = max_beams
        self._skipping = skipping

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:
        """Return the factor for the weight of each particle."""
        used = beams.short()
        x, y = used.end_points(particles)
        logarithms = self._grid.look_up(self._table(beams.range_max), x, y)
        if self._skipping is not None and has_converged:
            near = self._grid.look_up(self.distances, x, y) < self._skipping.distance
            kept = near.mean(axis=0) > self._skipping.threshold
            skipped = self._max_beams - int(kept.sum())
            if skipped < self._max_beams * self._skipping.error_threshold:
                logarithms = logarithms[:, kept]
        found: Array = np.exp(logarithms.sum(axis=1))
        return found

    def _make_table(self, range_max: float) -> Array:
        with np.errstate(divide="ignore"):  # a probability is 0 if z_rand is 0
            logarithms: Array = np.log(self._probabilities(range_max))
        return logarithms
