"""Match scans to the maps of particles, by hill climbing, for several particles at once.

The score of a pose is the sum of exp(-d² / sigma) over the beams, with the distance d in metres from the end
of the beam to the nearest mean of the ends in a cell of the map (the likelihood of the paper's section III-B,
with endpoints). It counts cells within `kernelSize` of the end that were hit, while the cell before, one and
a half cells closer to the laser, was not: so a beam is not matched to the back of a wall.
"""

from __future__ import annotations

from itertools import product
from math import sqrt
from typing import Final

import numpy as np

from pipros.navigation.mapping.hit_maps import Array, Cells, DenseWindow, HitMaps, cells_of
from pipros.navigation.mapping.settings import MappingSettings

CHUNK: Final = 8
"""Particles that are matched at the same time: their parts of the maps fit into the processor's cache."""
_MARGIN_M: Final = 1.0
"""How far the search may move a pose; beyond, ends of beams count as on the border of the window."""
_NO_HIT: Final = -0.5
_MOVES: Final = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)


class ScanMatcher:
    """Matches scans of one laser."""

    def __init__(self, settings: MappingSettings, angles: Array) -> None:
        self._settings = settings
        self._cosine, self._sine = np.cos(angles), np.sin(angles)
        reach = settings.kernelSize
        self._kernel = list(product(range(-reach, reach + 1), repeat=2))

    def match(self, maps: HitMaps, poses: Array, ranges: Array) -> tuple[Array, Array]:
        """Return better poses, shape (n, 3), and the logarithms of the likelihoods of the scan there.

        A pose whose best score is not above `minimumScore` stays as it is.
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
        found[score <= settings.minimumScore] = poses[score <= settings.minimumScore]
        squares = self._squares(window, np.arange(len(which)), found[:, None], used, ranges)[:, 0]
        logs = np.where(np.isfinite(squares), -squares, _NO_HIT) / settings.lsigma
        return found, logs.sum(axis=1)

    def _climb(self, window: DenseWindow, start: Array, used: Cells, ranges: Array) -> tuple[Array, Array]:
        """Return the best poses found from `start`, and their scores."""
        settings = self._settings

        def score(which: Cells, poses: Array) -> Array:
            squares = self._squares(window, which, poses, used, ranges)
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

    def _squares(self, window: DenseWindow, which: Cells, poses: Array, used: Cells, ranges: Array) -> Array:
        """Return the squared distances d² of beams, infinite without a cell; shape (particles, poses, beams).

        Args:
            which: the particles (indexes of the window).
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
        x, y = x.ravel(), y.ravel()
        nearest = np.full(end.size, np.inf)
        for rows, columns in self._kernel:
            cell = end + (rows * width + columns)
            found = np.flatnonzero(is_hit.take(cell))
            found = found[~is_hit.take(cell[found] + before[found])]
            cell = cell[found]
            square = (x[found] - mean_x[cell]) ** 2 + (y[found] - mean_y[cell]) ** 2
            nearest[found] = np.minimum(nearest[found], square)
        return nearest.reshape(len(which), poses.shape[1], len(used))
