"""The program `amcl`."""

from __future__ import annotations

import sys

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.navigation.amcl.amcl_node import AmclNode
from pipros.navigation.amcl.settings import read_settings
from pipros.navigation.parameters import InvalidParameter, read_parameters
from pipros.node.roscpp_program import roscpp_program


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter or an argument is invalid."""
    if "--run-from-bag" in sys.argv:
        print(
            "ERROR: amcl: --run-from-bag is not supported. Try: rosparam set use_sim_time true; "
            "rosbag play --clock BAG",
            file=sys.stderr,
        )
        return 1
    with roscpp_program("amcl", "amcl") as (node, log):
        parameters = read_parameters(node)
        try:
            settings = read_settings(parameters)
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        AmclNode(node, log, settings, parameters).run()
    return 0
