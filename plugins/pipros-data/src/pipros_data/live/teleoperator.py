"""Read a person's commands, which a joystick or a leader arm publishes, as actions."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipros.basics.env import Environment
from pipros.node import Node
from pipros.safe.settings import BadSettings
from pipros_data.datasets.config import read_config
from pipros_data.live.commands import is_stopped_by_zeros
from pipros_data.live.sources import LiveSource, full_names, wait_for_all

if TYPE_CHECKING:
    from numpy.typing import NDArray


class LiveTeleoperator:
    """Source of actions, read from the `teleop` topics in `robot.yaml`. Not thread-safe.

    Attributes:
        action_names: the names of the numbers; see `LiveRobot`.
    """

    def __init__(self, path: str | Path, *, master_uri: str | None = None, timeout_s: float = 5.0) -> None:
        """Connect, and wait for a message on each topic. Raises the errors of `LiveRobot`."""
        config = read_config(Path(path))
        for each in config.actions:
            if each.teleop in ("", each.topic):
                raise BadSettings(f"{each.place}.teleop: must be a topic other than the action's own")
        environment = Environment(master_uri=master_uri) if master_uri else None
        self._node = Node("pipros_teleoperator", anonymous=True, environment=environment)
        self._node.start()
        try:
            sources = [LiveSource(self._node, each, each.teleop) for each in config.actions]
            self._sources = wait_for_all(sources, time.monotonic() + timeout_s)
        except BaseException:
            self.close()
            raise
        self.action_names = full_names(self._sources)

    def read(self) -> NDArray[np.float64]:
        """Return the last action.

        If zeros stop an action (see `is_stopped_by_zeros`), its numbers are replaced by zeros when they are
        older than its tolerance, or when no publisher is connected.

        Raises:
            RobotSilent: a message is malformed, or one of its numbers is missing or NaN.
            BadSettings: a message does not fit the description.
        """
        parts = []
        for each in self._sources:
            values = each.numbers()
            is_old = each.age_s > each.source.tolerance
            parts.append(
                np.zeros_like(values) if is_old and is_stopped_by_zeros(each.source, each.type) else values
            )
        return np.concatenate(parts) if parts else np.zeros(0)

    def close(self) -> None:
        """Disconnect."""
        self._node.shutdown()
