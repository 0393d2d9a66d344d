"""What `pipros doctor` says of gateways to ROS 2."""

from __future__ import annotations

import json

import pytest

from pipros_ros2.health import CHECK
from pipros_tools.health.plugin_check import PluginReply, plugin_checks

NODE = "/ros2_gateway_0"
DROPPED = {"kind": "topics", "direction": "to_ros2", "name": "/a", "dropped": 7, "reason": "too long"}


def report(passed: list[object], left_out: dict[str, str]) -> PluginReply:
    return PluginReply(CHECK, True, json.dumps({"passed": passed, "left_out": left_out, "by_rule": []}))


@pytest.mark.parametrize(("reply", "rules", "part"), [
    (report([], {}), [], ""),
    (PluginReply(CHECK, failure="no answer"), ["ros2-gateway"], "returned no valid status: no answer"),
    (PluginReply(CHECK, True, "{"), ["ros2-gateway"], "its status is malformed"),
    (report([DROPPED], {}), ["ros2-dropped"], "dropped messages of topics: to_ros2: /a: 7: too long"),
    (
        report([], {"topics: to_ros1: /a": "unknown"}),
        ["ros2-left-out"],
        "leaves out topics: to_ros1: /a: unknown",
    ),
])  # fmt: skip
def test_each_problem_of_a_gateway_is_found(reply: PluginReply, rules: list[str], part: str) -> None:
    findings = list(CHECK.judge(NODE, reply))

    assert [finding.rule for finding in findings] == rules
    assert all(part in finding.summary and finding.subjects == (NODE,) for finding in findings)
    assert CHECK in plugin_checks()
