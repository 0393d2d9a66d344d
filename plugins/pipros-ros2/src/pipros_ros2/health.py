"""Health check of gateways to ROS 2, for `pipros doctor`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from pipros.basics.printable import listed
from pipros_rosbag2.names import GATEWAY_PREFIX
from pipros_tools.health.finding import Findings, error, warning
from pipros_tools.health.plugin_check import PluginCheck, PluginReply


@dataclass(frozen=True, slots=True)
class GatewayReport:
    """The report of a gateway.

    Attributes:
        failure: why there is no valid report; empty if there is one.
        dropped: maps each topic, service or action that dropped messages to their number and the last reason.
        left_out: maps each topic, service or action that is not forwarded, although no rule excludes it, to
            the reason.
    """

    failure: str = ""
    dropped: Mapping[str, str] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)


def gateway_report(text: str) -> GatewayReport:
    """Parse the report of a gateway. If it is malformed, the result's `failure` says so."""
    try:
        status = json.loads(text)
        dropped = {
            f"{row['kind']}: {row['direction']}: {row['name']}": f"{int(row['dropped'])}: {row['reason']}"
            for row in status["passed"]
            if row["dropped"]
        }
        by_rule = {*status["by_rule"]}
        left_out = {key: str(reason) for key, reason in status["left_out"].items() if key not in by_rule}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return GatewayReport("its status is malformed")
    return GatewayReport("", dropped, left_out)


def report(node: str, reply: PluginReply) -> Findings:
    """Yield findings if a gateway has no status, drops messages, or omits names that no rule excludes."""
    name = f"[{listed(node)}]"
    found = GatewayReport(reply.failure) if reply.failure else gateway_report(reply.message)
    if found.failure:
        yield error(
            "ros2-gateway",
            f"The gateway to ROS 2 {name} returned no valid status: {listed(found.failure)}",
            "See its output, and start it again if it does not recover.",
            node,
        )
    for what, reason in sorted(found.dropped.items()):
        yield warning(
            "ros2-dropped",
            f"The gateway to ROS 2 {name} dropped messages of {listed(what)}: {listed(reason)}",
            "`pipros ros2 status` shows what passes. The reason names the field, limit or slow side.",
            node,
        )
    for what, reason in sorted(found.left_out.items()):
        yield warning(
            "ros2-left-out",
            f"The gateway to ROS 2 {name} leaves out {listed(what)}: {listed(reason)}",
            "Give it the missing definitions with --msgs, or mapping rules with --mapping, or change its "
            "rules: a static rule sets the QoS of a topic, and a deny list excludes names.",
            node,
        )


CHECK = PluginCheck(GATEWAY_PREFIX, "status", report)
