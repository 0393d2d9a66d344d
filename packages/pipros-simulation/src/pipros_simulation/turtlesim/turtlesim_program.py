"""The `turtlesim_node` program: runs the node and its page."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.roscpp_program import roscpp_program
from pipros.node.start_params import is_on
from pipros_simulation.turtlesim.turtlesim_node import Turtlesim


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down, with its page unless the parameter `~headless` is true."""
    with roscpp_program("turtlesim", "turtlesim", argv) as (node, log), contextlib.ExitStack() as stack:
        turtlesim = Turtlesim(node, log)
        if not is_on(node, "~headless"):
            from pipros_server.node_page import served_page
            from pipros_simulation.turtlesim.turtle_page import TurtlePage

            stack.enter_context(served_page(TurtlePage(turtlesim, node).served_views(), node.name, log))
        turtlesim.run()
    return 0
