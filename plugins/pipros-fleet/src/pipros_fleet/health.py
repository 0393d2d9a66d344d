"""Health check for fleet agents, used by `pipros doctor`."""

from __future__ import annotations

from pipros.basics.printable import listed
from pipros_fleet.keys import AGENT_PREFIX
from pipros_tools.health.finding import Findings, error
from pipros_tools.health.plugin_check import PluginCheck, PluginReply


def link(node: str, reply: PluginReply) -> Findings:
    """Yield a finding if an agent's link is down."""
    reason = reply.failure or ("" if reply.success else "no router is connected")
    if reason:
        yield error(
            "fleet-link",
            f"The fleet agent [{listed(node)}] has no link to its fleet: {listed(reason)}",
            "Check that its router runs and can be reached from here, with `pipros fleet list --router "
            "ADDRESS`. Local nodes are not affected.",
            node,
        )


CHECK = PluginCheck(AGENT_PREFIX, "link", link)
