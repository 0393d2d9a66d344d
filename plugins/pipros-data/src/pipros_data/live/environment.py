"""A robot as a Gymnasium environment. Gymnasium must be installed separately."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pipros_data.extras import user_library
from pipros_data.live.robot import LiveRobot

_gymnasium = user_library("gymnasium", "the environment")
_Base: Any = _gymnasium.Env


class RobotEnvironment(_Base):  # type: ignore[misc]
    """`gymnasium.Env` for a robot. A step publishes an action, waits until it is due, and observes.

    Steps are due at the rate in the description, counted from `reset`. A late step does not shift the
    schedule; `info["late_s"]` is its delay. An observation contains `state` and the picture of each camera.

    Attributes:
        robot: the robot; its `state_names` and `action_names` are the names of the numbers.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        reward: Callable[[dict[str, Any], Any], float] | None = None,
        is_done: Callable[[dict[str, Any]], bool] | None = None,
        on_reset: Callable[[LiveRobot], object] | None = None,
        **options: Any,
    ) -> None:
        """Connect, with the options of `LiveRobot`. Raises the same errors.

        Args:
            reward: function that returns the reward for an observation and the preceding action; by
                default, the reward is 0.
            is_done: function that returns whether an observation ends the episode.
            on_reset: function that moves the robot to the start of an episode. It is called after the robot
                was stopped.
        """
        spaces = _gymnasium.spaces
        self.robot = LiveRobot(path, **options)
        self._reward, self._is_done, self._on_reset = reward, is_done, on_reset
        self._period_s = 1 / self.robot.config.rate
        self._next_s = 0.0
        least, most = self.robot.action_limits
        self.action_space = spaces.Box(least, most, dtype=np.float64)
        state = spaces.Box(-np.inf, np.inf, (len(self.robot.state_names),), np.float64)
        boxes = {name: spaces.Box(0, 255, shape, np.uint8) for name, shape in self.robot.cameras.items()}
        self.observation_space = spaces.Dict({"state": state, **boxes})

    def reset(
        self, *, seed: int | None = None, options: object = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Stop the robot, call `on_reset`, and return an observation; see `LiveRobot.observe` for errors."""
        super().reset(seed=seed, options=options)
        self.robot.stop()
        if self._on_reset is not None:
            self._on_reset(self.robot)
        self._next_s = time.monotonic()
        return self._observed(), {}

    def step(self, action: object) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Act, wait until the step is due, and observe. Raises the errors of `LiveRobot`."""
        self.robot.act(action)
        self._next_s += self._period_s
        late_s = time.monotonic() - self._next_s
        if late_s < 0:
            time.sleep(-late_s)
        else:
            self._next_s += late_s // self._period_s * self._period_s
        found = self._observed()
        reward = self._reward(found, action) if self._reward is not None else 0.0
        is_done = self._is_done is not None and self._is_done(found)
        return found, reward, is_done, False, {"late_s": max(late_s, 0.0)}

    def close(self) -> None:
        """Stop the robot, and disconnect."""
        self.robot.close()

    def _observed(self) -> dict[str, Any]:
        state, pictures = self.robot.observe()
        return {"state": state, **pictures}
