"""Forbid the robot to swing to and fro: after a change of direction, the old one is banned for a while."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipros.navigation.dwa.settings import DwaSettings
from pipros.navigation.dwa.trajectories import Array
from pipros.navigation.plane import Triple


class Oscillation:
    """The bans, per axis: x, y and turning."""

    def __init__(self) -> None:
        self._since: Triple = (0.0, 0.0, 0.0)
        self.reset()

    def reset(self) -> None:
        """End all bans."""
        self._last = [0, 0, 0]
        self._banned = [0, 0, 0]

    def forbids(self, commands: Array) -> NDArray[np.bool_]:
        """Return which velocities, shape (n, 3), have a banned sign."""
        banned = np.array(self._banned)
        forbidden: NDArray[np.bool_] = ((np.sign(commands) == banned) & (banned != 0)).any(axis=1)
        return forbidden

    def note(self, command: Triple, pose: Triple, settings: DwaSettings) -> None:
        """Note the chosen velocity: start a ban if it changed its sign, and end bans after enough motion.

        Signs of y and of the turn only count while x is at most `min_vel_trans`.
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
