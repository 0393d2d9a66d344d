"""The program `costmap_2d_node`: one costmap, in the namespace `~costmap`."""

from __future__ import annotations

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.navigation.costmap.costmap import Costmap
from pipros.navigation.frames import Frames
from pipros.navigation.programs import run_node


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node(
        "costmap_node",
        "costmap_2d",
        lambda node, log, schedule: Costmap(node, log, Frames(node, log), schedule, "costmap"),
    )
