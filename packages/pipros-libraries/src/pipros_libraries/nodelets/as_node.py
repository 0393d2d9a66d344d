"""Run a single Python nodelet as its own node."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.packages.nodelets import package_of
from pipros_libraries.nodelets.hosting import CannotLoad, Hosting

FAILED: Final = 255


@exits_after_ctrl_c()
def main(plugin: str, node_name: str, argv: Sequence[str] | None = None) -> int:
    """Run the nodelet until the node is shut down. Return the exit code.

    Args:
        plugin: the nodelet, such as `pcl/VoxelGrid`.
        node_name: the default name of the node.
        argv: the command-line arguments; by default, the arguments of the process.
    """
    with roscpp_program(node_name, package_of(plugin), argv) as (node, log):
        return run_alone(node, log, plugin)


def run_alone(node: Node, log: logging.Logger, plugin: str, arguments: Sequence[str] = ()) -> int:
    """Load a nodelet with the node's name, and wait until the node is shut down. Return the exit code."""
    try:
        Hosting(node).load(node.name, plugin, arguments=arguments)
    except CannotLoad as error:
        if node.is_ending:  # Ctrl-C interrupted a call to the master
            return 0
        log.critical("Failed to load nodelet '%s' of type '%s': %s", node.name, plugin, error)
        return FAILED
    node.wait_for_shutdown()
    return 0
