"""Diagnostics of a member's links."""

import pytest

from pipros_fleet.health import CHECK
from pipros_fleet.statistics import LinkTraffic, link_statuses
from pipros_libraries.diagnostics.link_status import LinkLevel, LinkStatus
from pipros_tools.health.plugin_check import PluginReply, plugin_checks


def statuses(is_connected: bool = True, **before: LinkTraffic) -> list[LinkStatus]:
    return link_statuses(
        "operator", is_connected=is_connected, sent=[(1, 10, 2, 3), (4, 40, 0, 0)],
        received={"robot2": LinkTraffic(1, 5), "robot1": LinkTraffic(2, 100, 7, 1)}, before=before,
    )  # fmt: skip


def test_the_link_and_each_member_are_components() -> None:
    link, robot1, robot2 = statuses(robot1=LinkTraffic(2, 90, 7, 1))
    assert (link.name, link.level, link.message) == ("/Fleet/operator", LinkLevel.OK, "connected")
    assert link.values == {"sent": "5", "bytes sent": "50", "dropped": "2", "unsent": "3"}
    assert (robot1.name, robot1.level, robot1.message) == ("/Fleet/operator/robot1", LinkLevel.OK, "present")
    assert robot1.values == {"topics received": "2", "messages": "100", "lost": "7", "malformed": "1"}
    assert robot2.name == "/Fleet/operator/robot2"


def test_new_losses_are_a_warning() -> None:
    _, robot1, robot2 = statuses(robot1=LinkTraffic(2, 90, 4, 0))
    assert (robot1.level, robot1.message) == (LinkLevel.WARN, "3 lost and 1 malformed recently")
    assert robot2.level is LinkLevel.OK


def test_a_link_that_is_down_is_an_error() -> None:
    link = statuses(is_connected=False)[0]
    assert (link.level, link.message) == (LinkLevel.ERROR, "no router is connected")


def test_a_member_that_has_sent_nothing() -> None:
    (link,) = link_statuses("a", is_connected=True, sent=[], received={}, before={})
    assert link.values["sent"] == "0"


# What `pipros doctor` says of fleet agents.


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
