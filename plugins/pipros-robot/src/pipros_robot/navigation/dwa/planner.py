"""Choose the velocity whose trajectory has the lowest score."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.costmap.grid import CostGrid
from pipros_robot.navigation.dwa.grid_costs import Points, outline_costs, plan_cells, waves
from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.dwa.trajectories import Array, Trajectories, simulated, window
from pipros_robot.navigation.plane import Triple

FORBIDDEN, HITS, OFF_MAP, BLOCKED, UNREACHED = -5.0, -6.0, -4.0, -3.0, -2.0
"""Scores of trajectories that oscillate, collide, leave the grid, or enter blocked or unreached cells."""

EQUAL = 1e-9
"""Scores that differ by at most this much count as equal."""
_FIRST = 64
"""Number of trajectories whose obstacles are looked at first, if only the best is wanted."""


class Oscillation:
    """Prevents oscillation: after a change of direction, the old direction is banned for a while."""

    def __init__(self) -> None:
        self._since: Triple = (0.0, 0.0, 0.0)
        self.reset()

    def reset(self) -> None:
        """End all bans."""
        self._last = [0, 0, 0]
        self._banned = [0, 0, 0]

    def forbids(self, commands: Array) -> NDArray[np.bool_]:
        """Return a mask of the velocities, shape (n, 3), that have a component with a banned sign."""
        banned = np.array(self._banned)
        forbidden: NDArray[np.bool_] = ((np.sign(commands) == banned) & (banned != 0)).any(axis=1)
        return forbidden

    def note(self, command: Triple, pose: Triple, settings: DwaSettings) -> None:
        """Record the chosen velocity: start a ban if a sign changed, and end bans after enough motion.

        Signs of y and of the turn count only while the absolute value of x is at most `min_vel_trans`.
        """
        is_new = False
        for axis, value in enumerate(command):
            sign = int(np.sign(value))
            if sign and (axis == 0 or abs(command[0]) <= settings.min_vel_trans):
                if self._last[axis] == -sign:
                    self._banned[axis] = -sign
                    is_new = True
                self._last[axis] = sign
        if is_new:
            self._since = pose
        if any(self._banned):
            moved = math.hypot(pose[0] - self._since[0], pose[1] - self._since[1])
            turned = abs(math.remainder(pose[2] - self._since[2], math.tau))
            if moved > settings.oscillation_reset_dist or turned > settings.oscillation_reset_angle:
                self.reset()


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The result of a planning cycle.

    Attributes:
        command: the chosen velocity, or None if all trajectories were discarded.
        way: the poses on the chosen trajectory, shape (k, 3).
        tried: all trajectories.
        scores: their scores, shape (n,); negative if discarded, inf if the trajectory cannot be the best.
    """

    command: Triple | None
    way: Array
    tried: Trajectories
    scores: Array


class DwaPlanner:
    """Chooses velocities. Not thread-safe.

    Attributes:
        settings: the settings; may be replaced between two cycles.
    """

    def __init__(self, settings: DwaSettings) -> None:
        self.settings = settings
        self._oscillation = Oscillation()
        self._alignment = 0.0

    def start_plan(self) -> None:
        """Reset for a new plan: end all bans."""
        self._oscillation.reset()

    def look_at(self, grid: CostGrid, footprint: Points, pose: Triple, plan: Points) -> None:
        """Prepare to score trajectories from a pose along a plan. The plan ends at the local goal."""
        settings, (goal_x, goal_y) = self.settings, plan[-1]
        self._grid, self._footprint, self._goal = grid, footprint, plan[-1]
        ahead, angle = settings.forward_point_distance, math.atan2(goal_y - pose[1], goal_x - pose[0])
        nose = np.array(plan)
        nose[-1] += ahead * math.cos(angle), ahead * math.sin(angle)
        path = plan_cells(grid, plan)
        self.distances = waves(grid, [path, path[-1:], plan_cells(grid, nose)[-1:]])
        distance = math.hypot(goal_x - pose[0], goal_y - pose[1])
        is_far = distance**2 > ahead**2 * settings.cheat_factor
        self._alignment = settings.path_distance_bias if is_far else 0.0

    def choose(self, pose: Triple, velocity: Triple, *, only_best: bool = False) -> Choice:
        """Return the best velocity for a robot with this pose and velocity. Call `look_at` first.

        With `only_best`, the command is the same, but trajectories that cannot be the best are not scored.
        """
        samples = window(self.settings, pose, velocity, self._goal)
        tried = simulated(self.settings, pose, velocity, samples)
        scores = self.scores(tried, only_best=only_best)
        legal = np.flatnonzero(scores >= 0)
        if not legal.size:
            return Choice(None, np.empty((0, 3)), tried, scores)
        best = int(legal[np.argmin(scores[legal])])
        x, y, turn = map(float, tried.commands[best])
        self._oscillation.note((x, y, turn), pose, self.settings)
        return Choice((x, y, turn), tried.way(best), tried, scores)

    def _is_forbidden(self, moves: Array) -> NDArray[np.bool_]:
        """Return which velocities are banned, or impossible for a car with the least radius of turns."""
        radius = self.settings.min_turning_radius
        forwards, sideways, turn = np.abs(moves).T
        is_impossible = (turn * radius > forwards + 1e-9) | ((sideways > 0) & (radius > 0))
        found: NDArray[np.bool_] = self._oscillation.forbids(moves) | is_impossible
        return found

    def is_legal(self, pose: Triple, velocity: Triple, command: Triple) -> bool:
        """End all oscillation bans, and return whether the trajectory with velocity `command` is legal.

        A velocity for which `simulated` returns no trajectory, such as standstill, is legal.
        """
        self._oscillation.reset()
        tried = simulated(self.settings, pose, velocity, np.array([command]))
        return not len(tried) or bool(self.scores(tried)[0] >= 0)

    def scores(self, tried: Trajectories, *, only_best: bool = False) -> Array:
        """Return the scores of trajectories. The lowest is best; a negative score means discarded.

        With `only_best`, the scores of trajectories that cannot be the best are inf.
        """
        settings, (scale, _) = self.settings, self.scales()
        scores = np.where(self._is_forbidden(tried.commands), FORBIDDEN, 0.0)
        path, goal, nose = self.distances
        to_goal = settings.goal_distance_bias
        for ahead, terms in (
            (0.0, ((settings.path_distance_bias, path), (to_goal, goal))),
            (settings.forward_point_distance, ((self._alignment, path), (to_goal, nose))),
        ):
            used = [(bias, distance) for bias, distance in terms if bias]
            found = self._distance_scores(tried, [distance for _, distance in used], ahead)
            for (bias, _), each in zip(used, found, strict=True):
                add_scores(scores, each, bias * scale)
        if settings.twirling_scale:
            add_scores(scores, np.abs(tried.commands[:, 2]), settings.twirling_scale)
        if settings.occdist_scale:
            self._add_obstacle_scores(scores, tried, settings.occdist_scale, only_best=only_best)
        return scores

    def _add_obstacle_scores(
        self, scores: Array, tried: Trajectories, weight: float, *, only_best: bool
    ) -> None:
        """Add the costs under the footprint to the scores.

        Costs are not negative. With `only_best`, the trajectories are looked at in the order of their other
        scores, until these alone exceed the best score.
        """
        left, best = np.flatnonzero(scores >= 0), math.inf
        left = left[scores[left].argsort()]
        count = _FIRST if only_best else len(left)
        while left.size:
            chosen, left, count = left[:count], left[count:], 2 * count
            found = self._obstacle_scores(tried, chosen)
            scores[chosen] = np.where(found < 0, found, scores[chosen] + found * weight)
            best = min(best, scores[chosen].min(where=found >= 0, initial=math.inf))
            if only_best:
                end = int(scores[left].searchsorted(best + EQUAL, "right"))
                scores[left[end:]] = math.inf
                left = left[:end]

    def scales(self) -> tuple[float, float]:
        """Return the factors of distances in cells and of costs, in addition to their weights."""
        return self._grid.resolution, 1.0

    def _distance_scores(
        self, tried: Trajectories, distances: Iterable[NDArray[np.int64]], ahead: float
    ) -> list[Array]:
        """Return distances at the end of each trajectory, or at a point `ahead` metres ahead of the end.

        Trajectories that leave the grid are discarded. If `ahead` is 0, trajectories through obstacles or
        unreached cells are also discarded.

        Args:
            distances: grids of distances. One array is returned for each.
        """
        x, y = tried.x, tried.y
        if ahead:
            x, y = x + ahead * np.cos(tried.yaw), y + ahead * np.sin(tried.yaw)
        is_part = np.arange(x.shape[1]) < tried.counts[:, None]
        columns, rows, inside = self._grid.world_to_cells(x, y)
        is_off, last = (~inside & is_part).any(1), (np.arange(len(tried)), tried.counts - 1)
        results = []
        for distance in distances:
            scores: Array = distance[rows[last], columns[last]].astype(float)
            found, cells = (None if ahead else distance[rows, columns]), distance.size
            if found is not None and (found >= cells).any():
                scores[((found == cells + 1) & is_part).any(1)] = UNREACHED
                scores[((found == cells) & is_part).any(1)] = BLOCKED
            scores[is_off] = OFF_MAP
            results.append(scores)
        return results

    def _obstacle_scores(self, tried: Trajectories, chosen: NDArray[np.int64]) -> Array:
        """Return the greatest cost, or the sum of costs, under the footprint along each trajectory."""
        counts = tried.counts[chosen]
        is_part = np.arange(tried.x.shape[1]) < counts[:, None]
        x, y, yaw = (each[chosen][is_part] for each in (tried.x, tried.y, tried.yaw))
        growth = np.repeat(self._growth(tried.commands[chosen]), counts)
        found = outline_costs(self._grid, self._footprint, x, y, yaw, growth)
        columns, rows, _ = self._grid.world_to_cells(x, y)
        costs = np.zeros(is_part.shape, np.int64)
        costs[is_part] = np.where(found < 0, found, np.maximum(found, self._grid.costs[rows, columns]))
        total = costs.sum(1) if self.settings.sum_scores else costs.max(1, initial=0)
        scores: Array = np.where((costs < 0).any(1), HITS, total)
        return scores

    def _growth(self, commands: Array) -> Array:
        """Return the factors by which the footprint is enlarged. They increase with the speed."""
        settings = self.settings
        speed = np.hypot(commands[:, 0], commands[:, 1])
        beyond = max(settings.max_vel_trans - settings.scaling_speed, 1e-9)
        growth: Array = 1.0 + settings.max_scaling_factor * (speed - settings.scaling_speed) / beyond
        growth[speed <= settings.scaling_speed] = 1.0
        return growth


def add_scores(scores: Array, found: Array, weight: float) -> None:
    """Add a term to the scores. A negative value discards a trajectory."""
    kept = scores >= 0
    scores[kept] = np.where(found < 0, found, scores + found * weight)[kept]
