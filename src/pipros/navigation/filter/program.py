"""The programs `ekf_localization_node` and `ukf_localization_node`."""

from __future__ import annotations

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.navigation.filter.filter_node import FilterNode
from pipros.navigation.filter.settings import make_timeline, read_settings
from pipros.navigation.parameters import InvalidParameter, read_parameters
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program


@exits_after_ctrl_c()
def main(name: str) -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    with roscpp_program(name, "robot_localization") as (node, log):
        parameters = read_parameters(node)
        try:
            settings = read_settings(parameters, _tf_prefix(node))
            timeline = make_timeline(parameters, unscented=name.startswith("ukf"))
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        FilterNode(node, log, settings, timeline)
        node.wait_for_shutdown()
    return 0


def _tf_prefix(node: Node) -> str:
    found = node.params.search("tf_prefix")
    value = node.params.get(found) if found else ""
    return value if isinstance(value, str) else ""
