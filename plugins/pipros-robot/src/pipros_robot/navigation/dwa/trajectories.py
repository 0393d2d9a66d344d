"""Sample velocities, and simulate the robot's trajectory for each velocity, as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.plane import Triple

Array = NDArray[np.float64]

_SLACK = 1e-4
"""Tolerance for the least and the greatest velocities, in m/s and rad/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectories:
    """Simulated trajectories.

    Attributes:
        commands: the velocities to command, shape (n, 3).
        goals: the sampled velocities, shape (n, 3): those to which the robot accelerates without `use_dwa`.
        x, y, yaw: the poses of each trajectory, shape (n, m), beginning with the robot's pose.
        counts: the number of poses of each trajectory, shape (n,); the rest of each row is padding.
    """

    commands: Array
    goals: Array
    x: Array
    y: Array
    yaw: Array
    counts: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.counts)

    def way(self, index: int) -> Array:
        """Return the poses of one trajectory, shape (k, 3)."""
        k = self.counts[index]
        return np.column_stack((self.x[index, :k], self.y[index, :k], self.yaw[index, :k]))


def sampled(low: float, high: float, count: int) -> list[float]:
    """Return evenly spaced values from `low` to `high`, and 0 if it lies between them.

    Return a single value if `low` equals `high`.
    """
    if low == high:
        return [low]
    count = max(count, 2)
    step, following, values = (high - low) / (count - 1), low, []
    for _ in range(count - 1):
        value, following = following, following + step
        values.append(value)
        if value < 0 < following:
            values.append(0.0)
    return [*values, high]


def within_reach(now: float, low: float, high: float, change: float) -> tuple[float, float]:
    """Return the least and the greatest velocity within reach; never beyond the limits.

    A measured velocity may be beyond them.
    """
    return min(high, max(low, now - change)), max(low, min(high, now + change))


def window(settings: DwaSettings, pose: Triple, velocity: Triple, goal: tuple[float, float]) -> Array:
    """Return velocities that the robot can reach, shape (n, 3): all combinations of the samples per axis.

    With `use_dwa`, these velocities can be reached within a period of the controller. Otherwise, they can be
    reached within `sim_time`, and do not overshoot the goal.
    """
    highest = [settings.max_vel_x, settings.max_vel_y, settings.max_vel_theta]
    lowest = [settings.min_vel_x, settings.min_vel_y, -settings.max_vel_theta]
    time_s = settings.sim_period if settings.use_dwa else settings.sim_time
    if not settings.use_dwa:
        farthest = math.hypot(goal[0] - pose[0], goal[1] - pose[1]) / settings.sim_time
        for axis in (0, 1):
            highest[axis] = max(min(highest[axis], farthest), lowest[axis])
    values = [
        sampled(*within_reach(now, low, high, gain * time_s), count)
        for low, high, now, gain, count in zip(
            lowest, highest, velocity, settings.accelerations, settings.samples, strict=True
        )
    ]
    samples: Array = np.stack(np.meshgrid(*values, indexing="ij"), axis=-1).reshape(-1, 3)
    return samples


def simulated(settings: DwaSettings, pose: Triple, velocity: Triple, samples: Array) -> Trajectories:
    """Return the trajectories with these velocities, except standstill and velocities outside the limits.

    Trajectories consist of straight steps, each in the robot's direction at the start of the step. Without
    `use_dwa`, the robot accelerates towards the velocity.
    """
    speed, turning = np.hypot(samples[:, 0], samples[:, 1]), np.abs(samples[:, 2])
    is_slow = (speed + _SLACK < settings.min_vel_trans) & (turning + _SLACK < settings.min_vel_theta)
    is_fast = speed - _SLACK > settings.max_vel_trans
    length = np.maximum(speed / settings.sim_granularity, turning / settings.angular_sim_granularity)
    counts = np.ceil(length * settings.sim_time).astype(np.int64)
    chosen = (counts > 0) & ~(is_slow & (settings.min_vel_trans >= 0) & (settings.min_vel_theta >= 0))
    chosen &= ~(is_fast & (settings.max_vel_trans >= 0))
    samples, counts = samples[chosen], counts[chosen]
    steps = int(counts.max(initial=1)) - 1
    dt = (settings.sim_time / np.maximum(counts, 1))[:, None]
    if settings.use_dwa:
        commands = samples
        rates = [np.repeat(samples[:, axis, None], steps, 1) for axis in range(3)]
    else:
        commands, rates = _accelerated(settings, velocity, samples, dt, steps)
    zero = np.zeros((len(samples), 1))
    yaw = pose[2] + np.hstack((zero, np.cumsum(rates[2] * dt, 1)))
    cosine, sine = np.cos(yaw[:, :-1]), np.sin(yaw[:, :-1])
    x = pose[0] + np.hstack((zero, np.cumsum((rates[0] * cosine - rates[1] * sine) * dt, 1)))
    y = pose[1] + np.hstack((zero, np.cumsum((rates[0] * sine + rates[1] * cosine) * dt, 1)))
    return Trajectories(commands, samples, x, y, yaw, counts)


def _accelerated(
    settings: DwaSettings, velocity: Triple, samples: Array, dt: Array, steps: int
) -> tuple[Array, list[Array]]:
    """Return the first velocity of each trajectory, and the velocity during each step per axis."""
    commands, rates = [], []
    for axis, (now, gain) in enumerate(zip(velocity, settings.accelerations, strict=True)):
        wanted = samples[:, axis, None]
        change = gain * dt * np.arange(1, steps + 2)
        reached = now + np.clip(wanted - now, -change, change)
        commands.append(reached[:, 0])
        rates.append(reached[:, 1:])
    return np.column_stack(commands), rates
