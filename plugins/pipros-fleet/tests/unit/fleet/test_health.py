"""What `pipros doctor` says of fleet agents."""

from __future__ import annotations

import pytest

from pipros_fleet.health import CHECK
from pipros_tools.health.plugin_check import PluginReply, plugin_checks

NODE = "/pipros_fleet_robot1"


@pytest.mark.parametrize(("reply", "reasons"), [
    (PluginReply(CHECK, True), []), (PluginReply(CHECK, False), ["no router is connected"]),
    (PluginReply(CHECK, failure="timed out"), ["timed out"]),
])  # fmt: skip
def test_an_agent_without_a_link_is_found(reply: PluginReply, reasons: list[str]) -> None:
    findings = list(CHECK.judge(NODE, reply))

    assert [(finding.rule, finding.subjects) for finding in findings] == [("fleet-link", (NODE,))] * len(
        reasons
    )
    assert [finding.summary.rpartition(": ")[2] for finding in findings] == reasons
    assert CHECK in plugin_checks()
