"""What the layers and the output of a costmap use of it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from threading import RLock
from typing import Protocol

from pipros.navigation.costmap.layered import LayeredCostmap
from pipros.navigation.costmap.sensor_input import SensorInput
from pipros.navigation.frames import Frames
from pipros.node import Node


class Host(Protocol):
    """A costmap of a node; `pipros.navigation.costmap.costmap.Costmap`.

    Attributes:
        lock: to be held by whoever reads or changes anything in `layered`.
        namespace: of the parameters and topics, such as `~global_costmap`.
        inputs: the subscriptions of all layers to sensors.
    """

    node: Node
    log: logging.Logger
    frames: Frames
    lock: RLock
    layered: LayeredCostmap
    namespace: str
    global_frame: str
    is_initialized: bool
    inputs: list[SensorInput]

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition; raise Interrupted if the node is shut down meanwhile."""

    def warn(self, text: str) -> None:
        """Log a warning, not too often."""
