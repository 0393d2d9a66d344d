"""Match scans to the maps of several particles at once by hill climbing.

The score of a pose is the sum of exp(-d² / sigma) over the beams (the likelihood of the paper's section
III-B, with end points). d is the distance in metres from the end of a beam to the nearest mean of ends in a
cell of the map. Only cells within `kernelSize` of the end are considered. These cells must have been hit, and
the adjacent cell in the direction of the laser must not have been hit, so that beams are not matched to the
back of a wall.

This score hardly depends on distances smaller than a cell. It is highest if beams end beside earlier ends,
so it favours rotations by multiples of the angle between beams. Therefore, the best poses are then refined by
least squares, so that the means lie on the lines through the ends of neighbouring beams. Offsets along a wall
are ignored (A. Censi, An ICP Variant Using a Point-to-Line Metric, IEEE International Conference on Robotics
and Automation, 2008).
"""

from __future__ import annotations

from itertools import product
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.mapping.hit_maps import Array, Cells, DenseWindow, HitMaps, cells_of
from pipros_robot.navigation.mapping.settings import MappingSettings

Places = NDArray[np.complex128]

CHUNK: Final = 8
"""Number of particles to match at the same time, so that their parts of the maps fit into the CPU cache."""
_MARGIN_M: Final = 1.0
"""How far the search may move a pose. Ends of beams outside the window are clipped to its border."""
_NO_HIT: Final = -0.5
_ALIGNMENTS: Final = 12
_DAMPING: Final = 1.0
"""Damping of the least squares, which keeps the pose in directions that walls do not constrain."""
_NEIGHBOURS_M: Final = 0.5
"""Maximum distance between neighbouring ends on a wall. `_OFF_LINE_M` limits their offset from its line."""
_OFF_LINE_M: Final = 0.03
_MOVES: Final = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)


class ScanMatcher:
    """Matches scans of one laser."""

    def __init__(self, settings: MappingSettings, angles: Array) -> None:
        self._settings = settings
        self._cosine, self._sine = np.cos(angles), np.sin(angles)
        reach = settings.kernelSize
        self._kernel = list(product(range(-reach, reach + 1), repeat=2))

    def match(self, maps: HitMaps, poses: Array, ranges: Array) -> tuple[Array, Array]:
        """Return improved poses, shape (n, 3), and the log-likelihoods of the scan at these poses.

        Poses whose best score is not above `minimumScore` are not changed.
        """
        parts = [
            self._match(maps, np.arange(first, min(first + CHUNK, len(poses))), poses, ranges)
            for first in range(0, len(poses), CHUNK)
        ]
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _match(self, maps: HitMaps, which: Cells, all_poses: Array, all_ranges: Array) -> tuple[Array, Array]:
        settings, poses = self._settings, all_poses[which]
        is_used = (all_ranges > 0.0) & (all_ranges <= settings.maxUrange)
        used = np.flatnonzero(is_used[:: settings.lskip + 1]) * (settings.lskip + 1)
        ranges = all_ranges[used]
        reach = float(ranges.max(initial=0.0)) + _MARGIN_M
        low, high = poses[:, :2].min(axis=0) - reach, poses[:, :2].max(axis=0) + reach
        window = maps.window(which, low, high)
        found, score = self._climb(window, poses, used, ranges)
        normals = wall_normals(ranges * (self._cosine[used] + 1j * self._sine[used]))
        for _ in range(_ALIGNMENTS):
            found = self._aligned(window, found, used, ranges, normals)
        found[score <= settings.minimumScore] = poses[score <= settings.minimumScore]
        squares = self._nearest(window, np.arange(len(which)), found[:, None], used, ranges)[0][:, 0]
        logs = np.where(np.isfinite(squares), -squares, _NO_HIT) / settings.lsigma
        return found, logs.sum(axis=1)

    def _climb(self, window: DenseWindow, start: Array, used: Cells, ranges: Array) -> tuple[Array, Array]:
        """Return the best poses found from `start`, and their scores."""
        settings = self._settings

        def score(which: Cells, poses: Array) -> Array:
            squares = self._nearest(window, which, poses, used, ranges)[0]
            total: Array = np.exp(-squares / settings.sigma).sum(axis=2)
            return total

        poses = start.copy()
        count = len(poses)
        current = score(np.arange(count), poses[:, None])[:, 0]
        best = np.full(count, -1.0)
        steps = np.tile((settings.lstep, settings.lstep, settings.astep), (count, 1))
        halvings = np.zeros(count, int)
        active = np.arange(count)
        while active.size:
            smaller = active[best[active] >= current[active]]
            steps[smaller] *= 0.5
            halvings[smaller] += 1
            best[active] = current[active]
            candidates = poses[active, None] + _MOVES * steps[active, None]
            scores = score(active, candidates)
            chosen = scores.argmax(axis=1)
            highest = scores[np.arange(active.size), chosen]
            better = highest > current[active]
            poses[active[better]] = candidates[better, chosen[better]]
            current[active[better]] = highest[better]
            active = active[better | (halvings[active] < settings.iterations)]
        return poses, current

    def _aligned(
        self, window: DenseWindow, poses: Array, used: Cells, ranges: Array, normals: Places
    ) -> Array:
        """Return poses at which the lines through neighbouring ends are closer to the nearest means."""
        *ends, all_cells = self._nearest(window, np.arange(len(poses)), poses[:, None], used, ranges)
        (squares, x, y), cells = (each[:, 0] for each in ends), all_cells[:, 0]
        normal = np.where(np.isfinite(squares), normals * np.exp(1j * poses[:, 2:]), 0.0)
        across, up = normal.real, normal.imag
        gaps = across * (window.x.take(cells) - x) + up * (window.y.take(cells) - y)
        by_turn: Array = up * (x - poses[:, :1]) - across * (y - poses[:, 1:2])
        slopes = np.stack((across, up, by_turn), axis=1)
        matrices = slopes @ slopes.swapaxes(1, 2) + _DAMPING * np.eye(3)
        aligned: Array = poses + np.linalg.solve(matrices, slopes @ gaps[:, :, None])[:, :, 0]
        return aligned

    def _nearest(
        self, window: DenseWindow, which: Cells, poses: Array, used: Cells, ranges: Array
    ) -> tuple[Array, Array, Array, Cells]:
        """Return the squared distances d², the x and y of the beams' ends, and the nearest cells.

        All have the shape (particles, poses, beams). Distances are infinity if there is no cell. Cells are
        flat indices of the window.

        Args:
            which: the particles (indices of the window).
            poses: poses of these particles, shape (particles, poses, 3).
        """
        delta, (_, height, width) = self._settings.delta, window.is_hit.shape
        turn = poses[:, :, 2:]
        cosine, sine = np.cos(turn), np.sin(turn)
        along = cosine * self._cosine[used] - sine * self._sine[used]
        across = sine * self._cosine[used] + cosine * self._sine[used]
        x, y = poses[:, :, :1] + ranges * along, poses[:, :, 1:2] + ranges * across
        border = self._settings.kernelSize + 2
        column = np.clip(cells_of(x, delta) - window.column, border, width - 1 - border)
        row = np.clip(cells_of(y, delta) - window.row, border, height - 1 - border)
        end = ((which[:, None, None] * height + row) * width + column).ravel()
        before = (np.rint(-sqrt(2.0) * across) * width + np.rint(-sqrt(2.0) * along)).astype(np.int64).ravel()
        is_hit, mean_x, mean_y = window.is_hit.ravel(), window.x.ravel(), window.y.ravel()
        flat_x, flat_y = x.ravel(), y.ravel()
        squares, nearest = np.full(end.size, np.inf), end.copy()
        for rows, columns in self._kernel:
            cell = end + (rows * width + columns)
            found = np.flatnonzero(is_hit.take(cell))
            found = found[~is_hit.take(cell[found] + before[found])]
            cell = cell[found]
            square = (flat_x[found] - mean_x[cell]) ** 2 + (flat_y[found] - mean_y[cell]) ** 2
            is_nearer = square < squares[found]
            found = found[is_nearer]
            squares[found], nearest[found] = square[is_nearer], cell[is_nearer]
        return squares.reshape(x.shape), x, y, nearest.reshape(x.shape)


def wall_normals(ends: Places) -> Places:
    """Return the unit normals of walls at the ends of beams; 0 without a wall. Vectors are x + iy."""
    before, after = ends - np.roll(ends, 1), np.roll(ends, -1) - ends
    along = before + after
    along /= np.maximum(np.abs(along), 1e-9)
    is_wall = np.maximum(np.abs(before), np.abs(after)) < _NEIGHBOURS_M
    is_wall &= np.abs((before * along.conj()).imag) < _OFF_LINE_M
    normals: Places = np.where(is_wall, 1j * along, 0.0)
    return normals
