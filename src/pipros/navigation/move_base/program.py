"""The program `move_base`."""

from __future__ import annotations

from pipros.basics.errors import Interrupted
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.navigation.move_base.move_base_node import MoveBase
from pipros.navigation.parameters import InvalidParameter
from pipros.navigation.schedule import Schedule
from pipros.node.roscpp_program import roscpp_program


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    with roscpp_program("move_base_node", "move_base") as (node, log):
        schedule = Schedule(node)
        try:
            MoveBase(node, log, schedule)
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        except Interrupted:
            return 0
        schedule.start()
        node.wait_for_shutdown()
    return 0
