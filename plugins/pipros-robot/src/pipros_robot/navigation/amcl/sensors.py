"""Sensor models, which compute how well a scan matches the map at each particle's pose."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.amcl.grid import Array, GridMap
from pipros_robot.navigation.amcl.settings import AmclSettings

_SMALLEST_SIGMA: Final = 1e-9
"""Replaces smaller standard deviations to avoid division by 0. Only exact readings are then hits."""
_LONGEST_M: Final = 10_000.0
"""Rays end here if the laser's longest range is greater, or infinite."""

_EXACT_CELLS: Final = 2800
_STEPS_AT_ONCE: Final = 4


@dataclass(frozen=True, slots=True)
class Beams:
    """Some beams of a scan.

    Attributes:
        ranges: in metres. Readings that are too short are `range_max`; readings that are too long are
            infinity.
        bearings: directions in the robot's frame, in radians.
        range_max: the laser's longest range, in metres.
        laser: position of the laser in the robot's frame, in metres.
    """

    ranges: Array
    bearings: Array
    range_max: float
    laser: tuple[float, float] = (0.0, 0.0)

    def end_points(self, particles: Array) -> tuple[Array, Array]:
        """Return x and y of the beams' ends for each particle; shape (particles, beams)."""
        forward = self.laser[0] + self.ranges * np.cos(self.bearings)
        left = self.laser[1] + self.ranges * np.sin(self.bearings)
        x, y, yaw = particles.T[:, :, None]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        return x + cosine * forward - sine * left, y + sine * forward + cosine * left

    def chosen(self, model: str, limit: int) -> Beams:
        """Return about `limit` evenly spaced beams, with the step that amcl's sensor model `model` uses."""
        count, is_product = len(self.ranges), model == "likelihood_field_prob"
        step = max(1, -(-count // limit) if is_product else (count - 1) // (limit - 1))
        return replace(self, ranges=self.ranges[::step], bearings=self.bearings[::step])

    def only(self, chosen: NDArray[np.bool_]) -> Beams:
        return replace(self, ranges=self.ranges[chosen], bearings=self.bearings[chosen])


def read_beams(
    ranges: Array, bearings: Array, laser: tuple[float, float], range_min: float, range_max: float
) -> Beams:
    """Return the beams of a scan. See `Beams` for ranges that are not between `range_min` and `range_max`."""
    cleaned = np.where(ranges <= range_min, range_max, np.where(ranges > range_max, np.inf, ranges))
    return Beams(cleaned, bearings, range_max, laser)


class LikelihoodField:
    """The model `likelihood_field`, which, as in amcl, adds the cubes of the probabilities of all beams.

    See Probabilistic Robotics, table 6.3. A beam whose end has the distance d from the nearest obstacle has
    the probability `z_hit * exp(-d² / (2 sigma_hit²)) + z_rand / range_max`. The probability depends only on
    the cell in which the beam ends, so it is computed once for each cell of the map.
    """

    def __init__(self, grid: GridMap, settings: AmclSettings) -> None:
        """Compute the distances, up to a maximum that is also used outside the map."""
        self._grid, self._settings = grid, settings
        self._distances = grid.obstacle_distances(settings.laser_likelihood_max_dist)
        self._table = lru_cache(maxsize=2)(self._make_table)

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:  # noqa: ARG002
        """Return the factor for each particle's weight: 1 + the sum of the cubes."""
        ends = beams.only(beams.ranges < beams.range_max).end_points(particles)  # excludes NaN
        found: Array = 1.0 + self._grid.look_up(self._table(beams.range_max), *ends).sum(axis=1)
        return found

    def _probabilities(self, range_max: float) -> Array:
        sigma = max(self._settings.laser_sigma_hit, _SMALLEST_SIGMA)
        nearness: Array = np.exp(-(self._distances**2) / (2.0 * sigma**2))
        return self._settings.laser_z_hit * nearness + self._settings.laser_z_rand / range_max

    def _make_table(self, range_max: float) -> Array:
        cubes: Array = self._probabilities(range_max) ** 3
        return cubes


class LikelihoodProduct(LikelihoodField):
    """The model `likelihood_field_prob`: the product of the probabilities of all beams.

    With `do_beamskip`, a converged filter skips beams that end near an obstacle for only a few particles,
    such as beams that hit people. If too many beams would be skipped, all beams are used.
    """

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:
        """Return the factor for each particle's weight."""
        ends = beams.only(beams.ranges < beams.range_max).end_points(particles)
        logarithms = self._grid.look_up(self._table(beams.range_max), *ends)
        settings = self._settings
        if settings.do_beamskip and has_converged:
            near = self._grid.look_up(self._distances, *ends) < settings.beam_skip_distance
            kept = near.mean(axis=0) > settings.beam_skip_threshold
            most = settings.laser_max_beams
            if most - int(kept.sum()) < most * settings.beam_skip_error_threshold:
                logarithms = logarithms[:, kept]
        found: Array = np.exp(logarithms.sum(axis=1))
        return found

    def _make_table(self, range_max: float) -> Array:
        with np.errstate(divide="ignore"):  # probabilities can be 0 if z_rand is 0
            logarithms: Array = np.log(self._probabilities(range_max))
        return logarithms


class BeamModel:
    """The model `beam`, which compares each beam with the range that the map predicts.

    See Probabilistic Robotics, table 6.1, without the normalizing factors. As in amcl, the cubes of the
    probabilities of all beams are added.
    """

    def __init__(self, grid: GridMap, settings: AmclSettings) -> None:
        self._grid, self._settings = grid, settings
        free = np.pad(grid.is_free, 1).astype(np.uint8)
        distances = cv2.distanceTransform(free, cv2.DIST_C, cv2.DIST_MASK_3)
        self._clear: NDArray[np.uint8] = np.minimum(distances, 255).astype(np.uint8)

    def factors(self, particles: Array, beams: Beams, *, has_converged: bool = False) -> Array:  # noqa: ARG002
        """Return the factor for each particle's weight: 1 + the sum of the cubes."""
        mix, beams = self._settings, beams.only(~np.isnan(beams.ranges))
        measured, longest = beams.ranges, beams.range_max
        starts = replace(beams, ranges=np.zeros(1), bearings=np.zeros(1)).end_points(particles)
        reach = np.full(len(measured), min(longest, _LONGEST_M))
        expected = self._expected(starts, replace(beams, ranges=reach).end_points(particles), longest)
        with np.errstate(invalid="ignore"):  # infinite ranges match nothing
            error = measured - expected
            short = mix.laser_z_short * mix.laser_lambda_short * np.exp(-mix.laser_lambda_short * measured)
            probability = np.square(error)
            probability /= -2.0 * max(mix.laser_sigma_hit, _SMALLEST_SIGMA) ** 2
            np.exp(probability, out=probability)
            probability *= mix.laser_z_hit
        probability += (error < 0) * short
        probability += np.where(measured == longest, mix.laser_z_max, 0.0)
        probability += np.where(measured < longest, mix.laser_z_rand / longest, 0.0)
        factors: Array = 1.0 + np.einsum("ij,ij,ij->i", probability, probability, probability)
        return factors

    def _expected(self, starts: tuple[Array, Array], ends: tuple[Array, Array], longest: float) -> Array:
        """Return the distance to the first cell on each ray that is not free, or `longest` if all are free.

        Rays follow Bresenham's lines. Let a be a line's length along its longer axis, and b along the other
        axis. After k steps along the longer axis, the line has moved (2kb + a) // 2a cells along the other.
        Rays skip cells: if all cells within a distance of k cells (in the eight directions) are free, so are
        the next k cells of the ray. The border of the map stops rays that leave it.
        """
        (row0, column0), (row1, column1) = self._grid.cells(*starts), self._grid.cells(*ends)
        shape, (height, width) = row1.shape, self._clear.shape
        rows, columns = (row1 - row0).ravel(), (column1 - column0).ravel()
        inside = (row0 >= -1) & (row0 < height - 1) & (column0 >= -1) & (column0 < width - 1)
        first = np.where(inside, (row0 + 1) * width + column0 + 1, 0)  # the corner is not free
        is_steep = abs(rows) > abs(columns)
        long, wide = np.maximum(abs(rows), abs(columns)), np.minimum(abs(rows), abs(columns))
        down, across = np.sign(rows) * width, np.sign(columns)
        # float32 is exact for integers below 2**24, which 2kb + a cannot exceed on lines shorter than
        # _EXACT_CELLS. A quotient that is rounded up would select the wrong cell.
        real = np.float32 if long.max(initial=0) < _EXACT_CELLS else np.float64
        whole = [np.broadcast_to(first, shape).ravel(), np.where(is_steep, down, across)]
        whole += [np.where(is_steep, across, down), np.zeros_like(long)]
        start, along, aside, step = (each.astype(np.int32) for each in whole)
        lines: Any = (each.astype(real) for each in (long, 2 * wide, 2 * np.maximum(long, 1)))
        length, rise, run = lines
        found, clear, ray = np.full(long.size, longest), self._clear.ravel(), np.arange(long.size)
        while ray.size:
            for _ in range(_STEPS_AT_ONCE):  # rays that have stopped stay where they are
                beside = ((step * rise + length) / run).astype(np.int32)
                skipped = clear.take(start + step * along + beside * aside)
                step += skipped
            is_past, stops = step > length + 1, skipped == 0
            ended = np.flatnonzero(stops & ~is_past)
            found[ray[ended]] = np.hypot(step[ended], beside[ended]) * self._grid.resolution
            kept = np.flatnonzero(~stops & ~is_past)
            ray, start, along, aside, step = (each[kept] for each in (ray, start, along, aside, step))
            length, rise, run = length[kept], rise[kept], run[kept]
        return found.reshape(shape)


def sensor_model(grid: GridMap, settings: AmclSettings) -> LikelihoodField | BeamModel:
    """Return the sensor model selected by the settings."""
    if settings.laser_model_type == "beam":
        return BeamModel(grid, settings)
    is_product = settings.laser_model_type == "likelihood_field_prob"
    return (LikelihoodProduct if is_product else LikelihoodField)(grid, settings)
