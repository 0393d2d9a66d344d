"""The common base of a costmap's parts: its node, frames, lock and costs."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any, Final

from pipros.basics.errors import Interrupted
from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_robot.navigation.costmap.grid import CostGrid, Points
from pipros_robot.navigation.costmap.layered import LayeredCostmap

_WAIT_S: Final = 0.1
_WARNING_S: Final = 5.0


class CostmapCore:
    """A costmap without its layers and topics.

    Attributes:
        name: the last part of the namespace, such as `global_costmap`.
        given: the parameters at startup.
        global_frame, base_frame: the frames of the map and of the robot.
        layered: the costs and the layers. Hold `lock` while you read or change them.
        blind_without: the layers whose absence leaves the costmap without any sensor, so that the robot must
            not drive; empty if it sees.
        is_initialized: whether there has been an update since the costmap was created or last stopped.
    """

    def __init__(self, node: Node, log: logging.Logger, frames: Frames, name: str) -> None:
        """Wait for the robot's pose, without a time limit. Raises the same errors as `Costmap`."""
        self.node, self.log, self.frames = node, log, frames
        self.name, self.namespace = name, f"~{name}"
        self.lock = threading.RLock()
        self.given = read_parameters(node, self.namespace)
        self.global_frame = self.given.text("global_frame", "map").lstrip("/")
        self.base_frame = self.given.text("robot_base_frame", "base_link").lstrip("/")
        if not self.global_frame or not self.base_frame:
            raise InvalidParameter(f"{self.namespace}: global_frame and robot_base_frame must not be empty")
        self.is_initialized = False
        self.blind_without: list[str] = []
        self._throttle = Throttle(log, 1.0)
        self.wait_until(
            lambda: frames.buffer.can_transform(self.global_frame, self.base_frame, 0) is None,
            f"the transform from {self.base_frame} to {self.global_frame}",
        )
        self.layered = LayeredCostmap(
            is_rolling=self.given.boolean("rolling_window", False),
            tracks_unknown=self.given.boolean("track_unknown_space", False),
        )

    @property
    def grid(self) -> CostGrid:
        """The combined costs. Hold `lock` while you use them."""
        return self.layered.grid

    @property
    def footprint(self) -> Points:
        """The padded outline of the robot."""
        return self.layered.footprint

    @property
    def is_current(self) -> bool:
        """Whether the data of all enabled layers is recent enough for driving."""
        return self.layered.is_current and not self.blind_without

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition, and log a warning every 5 seconds.

        Raises:
            Interrupted: the node was shut down while waiting.
        """
        warned_s = time.monotonic()
        while not condition():
            if self.node.is_ending or self.node.wait_for_shutdown(_WAIT_S):
                raise Interrupted(f"the node was shut down while {self.name} waited for {what}")
            if time.monotonic() - warned_s > _WARNING_S:
                warned_s = time.monotonic()
                self.log.warning("%s waits for %s", self.name, what)

    def warn(self, text: str, *values: Any) -> None:
        """Log a warning, at most once a second for each `text`, regardless of the values."""
        self._throttle.warning(f"{self.name}: {text}", *values)
