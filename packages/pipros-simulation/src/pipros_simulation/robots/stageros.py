"""The `stageros` program: simulates a Stage world file, with the topics and frames of stage_ros."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.names import is_remapping_argument
from pipros.node.roscpp_program import roscpp_program
from pipros_simulation.robots.robot_endpoints import RobotInterface
from pipros_simulation.robots.robots_node import RobotsNode
from pipros_simulation.robots.sim_program import run
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.stage_file import read_stage

USAGE: Final = """USAGE: stageros [-g] [-d] [-u] <worldfile>
  -g: without a page
  -d, -u: accepted, without effect"""

NAMES: Final = RobotInterface(scan_frame="base_laser_link", scan_topic="base_scan")


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down. Return 1 for an invalid world, and 255 for invalid arguments."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    words = [word for word in arguments if not is_remapping_argument(word)]
    options = {word for word in words if word.startswith("-")}
    files = [word for word in words if word not in options]
    if len(files) != 1 or not options <= {"-g", "-d", "-u"}:
        print(USAGE, file=sys.stderr)
        return 255
    with roscpp_program("stageros", "stage_ros", arguments) as (node, log):
        if "-g" in options:
            node.params.set("~headless", True)

        def make() -> RobotsNode:
            world, robots, unused = read_stage(files[0])
            for text in unused:
                log.warning("%s: %s", files[0], text)
            return RobotsNode(node, Simulation(world, robots), names=NAMES)

        return run(node, log, make)
