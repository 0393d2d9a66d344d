"""The program `move_base`."""

from __future__ import annotations

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.navigation.move_base.move_base_node import MoveBase
from pipros.navigation.programs import run_node


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("move_base_node", "move_base", MoveBase)
