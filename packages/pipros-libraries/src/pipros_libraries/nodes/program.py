"""Run a node that replaces a C++ program."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence

from pipros.basics.errors import Interrupted
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.schedule import Schedule

__all__ = ["run_node"]


@exits_after_ctrl_c()
def run_node(
    name: str,
    package: str,
    make: Callable[[Node, logging.Logger, Schedule], object],
    argv: Sequence[str] | None = None,
    *,
    anonymous: bool = False,
) -> int:
    """Run a node, which `make` sets up, until it is shut down. Return 1 if a parameter is invalid.

    See `roscpp_program` for the other arguments.
    """
    with roscpp_program(name, package, argv, anonymous=anonymous) as (node, log):
        schedule = Schedule(node)
        try:
            make(node, log, schedule)
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        except Interrupted:
            return 0
        schedule.start()
        node.wait_for_shutdown()
    return 0
