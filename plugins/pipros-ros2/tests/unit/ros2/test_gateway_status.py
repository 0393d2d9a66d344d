"""The reports of a gateway: for `pipros ros2 status`, for diagnostics, and for the doctor."""

import json
from collections import Counter
from dataclasses import replace
from typing import Any, cast

import pytest

from pipros_libraries.diagnostics.link_status import LinkLevel
from pipros_ros2.counts import Counts
from pipros_ros2.gateway_status import GatewayStatus, NotBridged, Row, problem_key
from pipros_ros2.health import CHECK, GatewayReport, gateway_report
from pipros_ros2.interface import Endpoint, EndpointKind, EngineProblem
from pipros_ros2.ros2_graph import Ros2Graph
from pipros_ros2.rules import Direction, RuleKind
from pipros_ros2.selection import GatewaySelection
from pipros_tools.health.plugin_check import PluginReply, plugin_checks

TYPES = ("std_msgs/String", "std_msgs/msg/String")
CHATTER = Row("topics", "to_ros2", "/chatter", TYPES, count=9, rate=4.5)
LOSSY = Row("topics", "to_ros1", "/lossy", TYPES, dropped=3, reason="too long")
STATUS = GatewayStatus(
    "ab_12", [CHATTER, LOSSY],
    {"topics: to_ros2: /secret": NotBridged("the deny list has it", by_rule=True),
        "topics: to_ros1: /strange": NotBridged("its type is unknown")},
)  # fmt: skip


def test_the_doctor_gets_what_is_dropped_and_left_out_without_a_rule() -> None:
    text = json.dumps(STATUS.values())

    assert gateway_report(text) == GatewayReport(
        "", {"topics: to_ros1: /lossy": "3: too long"}, {"topics: to_ros1: /strange": "its type is unknown"}
    )


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"passed": [{"dropped": 1}]}', "[" * 100_000])
def test_malformed_reports_are_failures(text: str) -> None:
    assert gateway_report(text) == GatewayReport("its status is malformed")


def test_diagnostics_warn_of_drops_and_of_names_that_are_left_out() -> None:
    status = STATUS.diagnosis("/ros2_gateway_0")

    assert (status.name, status.level) == ("/ROS 2/ros2_gateway_0", LinkLevel.WARN)
    assert status.message == (
        "2 topics, services and actions pass, 3 messages, calls or goals dropped, 1 left out"
    )
    assert status.values == {
        "topics: to_ros2: /chatter": "4.5/s, 0 dropped",
        "topics: to_ros1: /lossy": "0.0/s, 3 dropped: too long",
        "topics: to_ros1: /strange": "left out: its type is unknown",
    }
    assert GatewayStatus("ab_12", [CHATTER]).diagnosis("/g").level is LinkLevel.OK


def test_processes_in_ros2_leave_places_of_a_gateway_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"/{each}{number}" for each in "rabc" for number in range(2 if each == "c" else 20)]
    remote = [Endpoint(b"", EndpointKind.PUBLISHER, each, "", process=each[1]) for each in names[20:]]
    graph = Ros2Graph([*remote, replace(remote[-1], process="a")])
    keys = [(RuleKind.TOPIC, Direction.TO_ROS1, each) for each in names]
    monkeypatch.setattr(GatewaySelection, "wanted", lambda _: dict.fromkeys(keys))
    selection = GatewaySelection(cast(Any, None), cast(Any, None), graph)
    passed = selection.within(20, keys[27:28])
    assert Counter(name[1] for _, _, name in passed) == {"r": 10, "a": 4, "b": 4, "c": 2}
    assert keys[27] in passed
    assert "ros2_topics" in selection.skipped["topics: to_ros1: /a19"].reason


def test_problems_have_keys_like_names_that_are_left_out() -> None:
    chatter = problem_key(EngineProblem(EndpointKind.SUBSCRIBER, "/chatter", "", "/listener"))
    assert chatter == "topics: to_ros2: /chatter (subscriber /listener)"
    scan = problem_key(EngineProblem(EndpointKind.PUBLISHER, "/scan", "", "/laser"))
    assert scan == "topics: to_ros1: /scan (publisher /laser)"
    assert problem_key(EngineProblem(None, "/ros1_gateway_a_1", "")) == "nodes: to_ros2: /ros1_gateway_a_1"


# What `pipros doctor` says of gateways to ROS 2.


NODE = "/ros2_gateway_0"
DROPPED = {"kind": "topics", "direction": "to_ros2", "name": "/a", "dropped": 7, "reason": "too long"}


def report(passed: list[object], left_out: dict[str, str]) -> PluginReply:
    return PluginReply(CHECK, True, json.dumps({"passed": passed, "left_out": left_out, "by_rule": []}))


@pytest.mark.parametrize(("reply", "rules", "part"), [
    (report([], {}), [], ""),
    (PluginReply(CHECK, failure="no answer"), ["ros2-gateway"], "returned no valid status: no answer"),
    (PluginReply(CHECK, True, "{"), ["ros2-gateway"], "its status is malformed"),
    (report([DROPPED], {}), ["ros2-dropped"], "dropped messages of topics: to_ros2: /a: 7: too long"),
    (report([], {"topics: to_ros1: /a": "no"}), ["ros2-left-out"], "leaves out topics: to_ros1: /a: no"),
])  # fmt: skip
def test_each_problem_of_a_gateway_is_found(reply: PluginReply, rules: list[str], part: str) -> None:
    findings = list(CHECK.judge(NODE, reply))

    assert [finding.rule for finding in findings] == rules
    assert all(part in finding.summary and finding.subjects == (NODE,) for finding in findings)
    assert CHECK in plugin_checks()


# What a gateway counts of a topic, service or action.


def test_each_reason_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    counts = Counts()

    for reason in ("too long", "too long", "not UTF-8"):
        counts.fail(reason)

    assert (counts.dropped, counts.reason) == (3, "not UTF-8")
    assert caplog.messages == ["too long", "not UTF-8"]


def test_drops_of_queues_add_up_when_queues_are_replaced(caplog: pytest.LogCaptureFixture) -> None:
    counts = Counts()

    for queue, total in (("a", 0), ("a", 3), ("b", 2), ("a", 3), ("a", 1), ("a", 4), ("b", 2)):
        counts.overflow(queue, total, "too slow")

    assert (counts.overflowed, counts.dropped, counts.reason) == (9, 9, "too slow")
    assert caplog.messages == ["too slow"]
