"""The reports of a gateway: for `pipros ros2 status`, for diagnostics, and for the doctor."""

from __future__ import annotations

import json

import pytest

from pipros_libraries.diagnostics.link_status import LinkLevel
from pipros_ros2.gateway_status import GatewayStatus, NotBridged, Row, problem_key
from pipros_ros2.health import GatewayReport, gateway_report
from pipros_ros2.interface import EndpointKind, EngineProblem

TYPES = ("std_msgs/String", "std_msgs/msg/String")
CHATTER = Row("topics", "to_ros2", "/chatter", TYPES, count=9, rate=4.5)
LOSSY = Row("topics", "to_ros1", "/lossy", TYPES, dropped=3, reason="too long")
STATUS = GatewayStatus(
    "ab_12",
    [CHATTER, LOSSY],
    {
        "topics: to_ros2: /secret": NotBridged("the deny list has it", by_rule=True),
        "topics: to_ros1: /strange": NotBridged("its type is unknown"),
    },
)


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


def test_problems_have_keys_like_names_that_are_left_out() -> None:
    problems = [
        EngineProblem(EndpointKind.SUBSCRIBER, "/chatter", "", "/listener"),
        EngineProblem(EndpointKind.PUBLISHER, "/scan", "", "/laser"),
        EngineProblem(None, "/ros1_gateway_a_1", ""),
    ]

    assert [problem_key(each) for each in problems] == [
        "topics: to_ros2: /chatter (subscriber /listener)",
        "topics: to_ros1: /scan (publisher /laser)",
        "nodes: to_ros2: /ros1_gateway_a_1",
    ]
