"""The `turtlebot3_fake_node` program: simulates a robot that follows `cmd_vel` on an empty plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.robot_endpoints import RobotInterface
from pipros_simulation.robots.robots_node import RobotsNode
from pipros_simulation.robots.settings import RobotSettings
from pipros_simulation.robots.sim_program import run
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World

_HALF_SIDE_M: Final = 50.0
_CELL_M: Final = 0.25

_START: Final = Pose()
MODELS: Final = {
    "burger": RobotSettings(
        start=_START, radius=0.105, wheel_separation=0.160, max_linear=0.22, max_angular=2.84, laser=None
    ),
    "waffle": RobotSettings(
        start=_START, radius=0.220, wheel_separation=0.287, max_linear=0.26, max_angular=1.82, laser=None
    ),
}
"""Dimensions and maximum velocities of the robots by name; `waffle_pi` is the same as `waffle`."""


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down. Return 1 if the model is unknown."""
    with roscpp_program("turtlebot3_fake_node", "turtlebot3_fake", argv) as (node, log):
        return run(node, log, lambda: _fake(node))


def _fake(node: Node) -> RobotsNode:
    """Create a robot of the model in the parameter `/tb3_model`."""
    model = node.params.get("/tb3_model") if node.params.has("/tb3_model") else "burger"
    settings = MODELS.get(str(model).removesuffix("_pi"))
    if settings is None:
        raise InvalidSettings(f"/tb3_model must be burger, waffle or waffle_pi, got {model!r}")
    side = round(2 * _HALF_SIDE_M / _CELL_M)
    plane = World.from_cells(np.zeros((side, side), bool), _CELL_M, (-_HALF_SIDE_M, -_HALF_SIDE_M))
    # The robot description, if one is loaded, defines the frames below base_footprint in the tree.
    return RobotsNode(
        node, Simulation(plane, [settings]), names=RobotInterface(base_frames=("base_footprint",))
    )
