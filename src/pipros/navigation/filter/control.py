"""The response of a robot to velocity commands, for the prediction between measurements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipros.navigation.filter.state import Array, Command, Flags

_SLACK = 0.01
"""A command this much below the velocity still counts as of the same direction, m/s or rad/s."""


@dataclass(slots=True, eq=False)
class Control:
    """A proportional controller with limits for each of vx, vy, vz, vroll, vpitch, vyaw.

    Attributes:
        flags: the controlled axes.
        acceleration_limits, deceleration_limits: m/s² or rad/s².
        acceleration_gains, deceleration_gains: acceleration per difference of velocity, 1/s.
        timeout_s: commands that are older count as a command to stop.
        command: the newest command.
    """

    flags: Flags
    acceleration_limits: Array
    acceleration_gains: Array
    deceleration_limits: Array
    deceleration_gains: Array
    timeout_s: float
    command: Command | None = None

    def accelerations(self, velocity: Array, time_s: float) -> tuple[Flags, Array]:
        """Return the controlled axes and the accelerations; axes that are not controlled have 0.

        An axis decelerates if the command is slower than `velocity`, or has the opposite sign.
        """
        wanted = np.zeros(6)
        if self.command is not None and time_s - self.command.time_s < self.timeout_s:
            wanted = self.command.velocity
        difference = wanted - velocity
        goal = np.where(np.abs(difference) <= np.abs(wanted) + _SLACK, wanted, 0.0)
        brakes = np.abs(goal) < np.abs(velocity)
        limit = np.where(brakes, self.deceleration_limits, self.acceleration_limits)
        gain = np.where(brakes, self.deceleration_gains, self.acceleration_gains)
        found = np.clip(gain * difference, -limit, limit)
        return self.flags, np.where(self.flags, found, 0.0)
