"""Choose the velocity whose trajectory has the lowest score; rotate, strafe or back up if none is legal."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.dwa.grid_costs import outline_costs
from pipros_robot.navigation.dwa.planner import EQUAL, FORBIDDEN, Choice, DwaPlanner, add_scores
from pipros_robot.navigation.dwa.trajectories import Array, Trajectories, sampled, simulated, within_reach
from pipros_robot.navigation.plane import Triple
from pipros_robot.navigation.trajectory.settings import TrajectorySettings

_STRAFE = 0.1
"""Speed in m/s forwards and sideways of the two oblique trajectories of holonomic robots."""
_HEADING_WEIGHT = 0.3


class TrajectoryPlanner(DwaPlanner):
    """Chooses velocities. Not thread-safe.

    Attributes:
        own: the settings; `use` replaces them.
    """

    def __init__(self, settings: TrajectorySettings) -> None:
        super().__init__(settings.shared)
        self.own = settings
        self._escape_from: Triple | None = None

    def use(self, settings: TrajectorySettings) -> None:
        """Replace the settings between two cycles."""
        self.own, self.settings = settings, settings.shared

    def start_plan(self) -> None:
        """Do nothing: bans last until the robot has moved, because plans may be replaced every second."""

    def choose(self, pose: Triple, velocity: Triple, *, only_best: bool = False) -> Choice:
        """Return the best velocity for a robot with this pose and velocity. Call `look_at` first.

        With `only_best`, the command is the same, but trajectories that cannot be the best are not scored.
        """
        own = self.own
        self._end_escape(pose)
        samples = self._turns(velocity)
        if self._escape_from is None:
            samples = np.vstack((self._forwards(pose, velocity), samples))
        choice = self._best(pose, velocity, samples, only_best=only_best)
        if choice.command is None and own.holonomic_robot:
            sideways = np.array([(0.0, y, 0.0) for y in own.strafes]).reshape(-1, 3)
            choice = self._best(pose, velocity, sideways, only_best=only_best)
        if choice.command is None:
            return self._escape(pose, choice)
        self._oscillation.note(choice.command, pose, self.settings)
        return choice

    # -- candidates --------------------------------------------------------------

    def _reach(self, now: float, low: float, high: float, gain: float) -> tuple[float, float]:
        """Return the least and the greatest velocity within reach; never above the limits."""
        time_s = self.own.sim_period if self.own.dwa else self.own.sim_time
        return within_reach(now, low, high, gain * time_s)

    def _rates(self, velocity: Triple) -> list[float]:
        own = self.own
        low, high = self._reach(velocity[2], own.min_vel_theta, own.max_vel_theta, own.acc_lim_theta)
        return sampled(low, high, own.vtheta_samples)

    def _forwards(self, pose: Triple, velocity: Triple) -> Array:
        own = self.own
        farthest = math.hypot(self._goal[0] - pose[0], self._goal[1] - pose[1]) / own.sim_time
        fastest = own.max_vel_x if own.dwa else max(min(own.max_vel_x, farthest), own.min_vel_x)
        fastest = min(fastest, own.max_vel_x)
        low, high = self._reach(velocity[0], min(own.min_vel_x, fastest), fastest, own.acc_lim_x)
        rates = self._rates(velocity)
        made = [(x, 0.0, turn) for x in sampled(low, high, own.vx_samples) if x for turn in rates]
        if own.holonomic_robot:
            made += [(min(_STRAFE, own.max_vel_x), side, 0.0) for side in (_STRAFE, -_STRAFE)]
        return np.array(made).reshape(-1, 3)

    def _turns(self, velocity: Triple) -> Array:
        own = self.own
        slowest = own.min_in_place_vel_theta
        rates = np.array(
            [math.copysign(max(abs(rate), slowest), rate) for rate in self._rates(velocity) if rate]
        )
        rates = np.unique(np.clip(rates, own.min_vel_theta, own.max_vel_theta))
        return np.column_stack((np.zeros((len(rates), 2)), rates))

    # -- scores ------------------------------------------------------------------

    def _best(self, pose: Triple, velocity: Triple, samples: Array, *, only_best: bool) -> Choice:
        tried = simulated(self.settings, pose, velocity, samples)
        scores = self.scores(tried, only_best=only_best)
        legal = np.flatnonzero(scores >= 0)
        if not len(legal):
            return Choice(None, np.empty((0, 3)), tried, scores)
        best = int(legal[scores[legal].argmin()])
        equal = legal[scores[legal] <= scores[best] + EQUAL]
        turning = equal[~tried.goals[equal, :2].any(axis=1)]
        if len(turning):  # turns in place end at the same position: the point ahead decides
            (found,) = self._distance_scores(tried, self.distances[1:2], self.own.heading_lookahead)
            ahead = found[turning]
            best = int(turning[np.where(ahead < 0, np.inf, ahead).argmin()])
        x, y, turn = map(float, tried.goals[best])
        return Choice((x, y, turn), tried.way(best), tried, scores)

    def scores(self, tried: Trajectories, *, only_best: bool = False) -> Array:
        """Return the scores of trajectories. The lowest is best; a negative score means discarded.

        With `only_best`, the scores of trajectories that cannot be the best are inf.
        """
        own = self.own
        scores = np.where(self._is_forbidden(tried.goals), FORBIDDEN, 0.0)
        scale, _ = self.scales()
        last = np.arange(len(tried)), tried.counts - 1
        path, goal = self._distance_scores(tried, self.distances[:2], 0.0)
        if own.simple_attractor:
            away = (tried.x[last] - self._goal[0]) ** 2 + (tried.y[last] - self._goal[1]) ** 2
            path, goal = np.where(path < 0, path, 0.0), np.where(goal < 0, goal, away)
        elif own.heading_scoring:
            add_scores(scores, self._heading_scores(tried), _HEADING_WEIGHT)
        add_scores(scores, path, own.path_distance_bias * scale)
        add_scores(scores, goal, own.goal_distance_bias * scale)
        self._add_obstacle_scores(scores, tried, own.occdist_scale * scale, only_best=only_best)
        return scores

    def scales(self) -> tuple[float, float]:
        """Return the factors of distances in cells and of costs: `meter_scoring` keeps their relation."""
        scale = self._grid.resolution if self.own.meter_scoring else 1.0
        return scale, scale

    def _heading_scores(self, tried: Trajectories) -> Array:
        """Return the angles to the end of the local plan, `heading_scoring_timestep` after the start."""
        share = self.own.heading_scoring_timestep / self.own.sim_time
        index = np.minimum((share * tried.counts).astype(np.int64), tried.counts - 1)
        at = np.arange(len(tried)), index
        wanted = np.arctan2(self._goal[1] - tried.y[at], self._goal[0] - tried.x[at])
        found: NDArray[np.float64] = np.abs(np.remainder(wanted - tried.yaw[at] + np.pi, math.tau) - np.pi)
        return found

    # -- escapes -----------------------------------------------------------------

    def _end_escape(self, pose: Triple) -> None:
        start = self._escape_from
        if start is None:
            return
        moved = math.hypot(pose[0] - start[0], pose[1] - start[1])
        turned = abs(math.remainder(pose[2] - start[2], math.tau))
        if moved > self.own.escape_reset_dist or turned > self.own.escape_reset_theta:
            self._escape_from = None

    def _escape(self, pose: Triple, failed: Choice) -> Choice:
        """Back up, although the robot may touch an obstacle, if it is free at the end of the way.

        Genuine TrajectoryPlannerROS also backs up into obstacles.
        """
        speed = self.own.escape_vel
        steps = np.linspace(0.0, speed * self.own.sim_time, 10)
        x, y = pose[0] + steps * math.cos(pose[2]), pose[1] + steps * math.sin(pose[2])
        yaw = np.full(len(steps), pose[2])
        if not speed or (outline_costs(self._grid, self._footprint, x, y, yaw)[-1:] < 0).any():
            return failed
        if self._escape_from is None:
            self._escape_from = pose
        return Choice((speed, 0.0, 0.0), np.column_stack((x, y, yaw)), failed.tried, failed.scores)
