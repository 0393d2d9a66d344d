"""The rules of a gateway: which topics pass, under which name, and with which quality of service."""

import itertools
import json
import re
from dataclasses import fields

import pytest

from pipros_ros2.interface import Durability, Endpoint, EndpointKind, Reliability, TopicQos
from pipros_ros2.qos_choice import QosOverride, offered_qos, requested_qos
from pipros_ros2.qos_table import dds_qos, qos_of_dds, qos_of_rclpy, qos_of_zenoh, rclpy_qos, zenoh_qos
from pipros_ros2.rtps.qos import DurabilityKind, Qos
from pipros_ros2.rules import Direction, GatewayRules, RuleKind, StaticRule, parse_gateway_rules
from pipros_rosbag2.conversion.errors import InvalidRules
from tests.support import documents

RELIABLE, BEST_EFFORT = Reliability
VOLATILE, LATCHED = Durability


def publisher(key: bytes, reliability: Reliability, durability: Durability) -> Endpoint:
    qos = TopicQos(reliability, durability)
    return Endpoint(key, EndpointKind.PUBLISHER, "/a", "std_msgs/msg/String", qos=qos)


def test_publishers_are_reliable_unless_topics_are_special() -> None:
    assert offered_qos("/a", is_latched=False) == TopicQos(RELIABLE, VOLATILE, 10)
    assert offered_qos("/a", is_latched=False, queue_size=100).depth == 100
    assert offered_qos("/map", is_latched=True) == TopicQos(RELIABLE, LATCHED, 1)
    assert offered_qos("/tf_static", is_latched=False) == TopicQos(RELIABLE, LATCHED, 1)
    assert offered_qos("/clock", is_latched=False) == TopicQos(BEST_EFFORT, VOLATILE, 1)
    override = QosOverride(BEST_EFFORT, depth=5)
    assert offered_qos("/map", is_latched=True, override=override) == TopicQos(BEST_EFFORT, LATCHED, 5)


def test_the_guide_has_the_keys_of_qos_and_their_words() -> None:
    rule = documents.text_of("guides/ros2.md").partition("- `qos` has the keys ")[2].partition("\n\n")[0]
    keys = {each.name for each in fields(QosOverride)}
    assert {*re.findall(r"`(\w+)`", rule)} == {*keys, *(each.value for each in (*Reliability, *Durability))}


def test_subscribers_match_all_publishers() -> None:
    a, b = publisher(b"a", RELIABLE, VOLATILE), publisher(b"b", BEST_EFFORT, VOLATILE)

    (only,) = requested_qos([a])
    assert (only.qos, only.publishers) == (TopicQos(RELIABLE, VOLATILE, 1000), {b"a"})
    (both,) = requested_qos([a, b])
    assert (both.qos, both.publishers) == (TopicQos(BEST_EFFORT, VOLATILE, 10), {b"a", b"b"})
    (latched,) = requested_qos([publisher(b"c", RELIABLE, LATCHED)])
    assert (latched.qos.depth, requested_qos([])) == (10, ())


def test_latched_and_volatile_publishers_need_two_subscribers() -> None:
    a, b = publisher(b"a", RELIABLE, LATCHED), publisher(b"b", BEST_EFFORT, VOLATILE)

    first, second = requested_qos([a, b], override=QosOverride(depth=1))

    assert (first.qos, first.publishers) == (TopicQos(RELIABLE, LATCHED, 1), {b"a"})
    assert (second.qos, second.publishers) == (TopicQos(BEST_EFFORT, VOLATILE, 1), {b"b"})


@pytest.mark.parametrize(("kind", "direction", "is_local", "passes"), [
    (RuleKind.TOPIC, Direction.TO_ROS2, False, True), (RuleKind.TOPIC, Direction.TO_ROS1, True, True),
    (RuleKind.TOPIC, Direction.TO_ROS1, False, False), (RuleKind.SERVICE, Direction.TO_ROS1, True, False),
    (RuleKind.SERVICE, Direction.TO_ROS2, True, True),
    (RuleKind.SERVICE, Direction.TO_ROS2, False, False),
    (RuleKind.ACTION, Direction.TO_ROS1, True, False), (RuleKind.ACTION, Direction.TO_ROS2, True, True),
    (RuleKind.ACTION, Direction.TO_ROS2, False, False),
])  # fmt: skip
def test_little_enters_ros1_by_default(
    kind: RuleKind, direction: Direction, is_local: bool, passes: bool
) -> None:
    verdict = GatewayRules().verdict(kind, direction, "/a", is_local=is_local)

    assert verdict.passes is passes
    assert ("only if an allow list" in verdict.reason) is not passes


RULES = """
topics:
  to_ros2: {deny: [/camera/debug*]}
  to_ros1: {allow: ["/cmd_*", /rosout]}
  static:
    - {ros1: /scan, ros2: /front/scan, direction: to_ros2, rate: 5, qos: {reliability: best_effort, depth: 1}}
    - {ros1: /odom}
services:
  to_ros1: {allow: ["*"], deny: [/shutdown]}
"""


@pytest.mark.parametrize(("kind", "direction", "name", "reason"), [
    (RuleKind.TOPIC, Direction.TO_ROS2, "/camera/image", ""),
    (
        RuleKind.TOPIC,
        Direction.TO_ROS2,
        "/camera/debug_image",
        "the deny list (topics: to_ros2) contains",
    ),
    (RuleKind.TOPIC, Direction.TO_ROS1, "/cmd_vel", ""),
    (RuleKind.TOPIC, Direction.TO_ROS1, "/scan", "the allow list (topics: to_ros1) does not match it"),
    (RuleKind.TOPIC, Direction.TO_ROS1, "/rosout", ""),
    (RuleKind.TOPIC, Direction.TO_ROS2, "/rosout", "an internal name"),
    (RuleKind.TOPIC, Direction.TO_ROS2, "/turn/_action/status", "an internal name"),
    (RuleKind.SERVICE, Direction.TO_ROS1, "/reset", ""),
    (RuleKind.SERVICE, Direction.TO_ROS1, "/shutdown", "the deny list"),
    (RuleKind.SERVICE, Direction.TO_ROS1, "/node/get_loggers", "an internal name"),
])  # fmt: skip
def test_lists_decide(kind: RuleKind, direction: Direction, name: str, reason: str) -> None:
    verdict = parse_gateway_rules(RULES, "rules.yaml").verdict(kind, direction, name, is_local=False)

    assert verdict.passes is not bool(reason)
    assert verdict.reason.startswith(reason)


def test_static_rules_set_timeouts_of_services() -> None:
    rules = parse_gateway_rules("services: {static: [{name: /plan, timeout_s: 60}]}", "rules.yaml")
    assert rules.timeouts_s == {"/plan": 60.0}


def test_static_rules_rename_topics() -> None:
    rules = parse_gateway_rules(RULES, "rules.yaml")

    scan = rules.renamed(Direction.TO_ROS2, "/scan")
    assert scan == StaticRule(
        "/scan", "/front/scan", frozenset({Direction.TO_ROS2}), rate=5.0,
        qos=QosOverride(BEST_EFFORT, None, 1),
    )  # fmt: skip
    assert rules.renamed(Direction.TO_ROS1, "/front/scan") is None
    odom = rules.renamed(Direction.TO_ROS1, "/odom")
    assert odom is not None
    assert (odom.ros2, odom.directions) == ("/odom", frozenset(Direction))


@pytest.mark.parametrize(("text", "reason"), [
    ("[1]", "expected a mapping, got list"),
    ("topic: {}", "unknown key topic; the keys are actions, services, topics"),
    ("topics: {to_ros1: {allow: /a}}", "expected a list, got str"),
    ("topics: {to_ros1: {allow: [a]}}", "must begin with / or"),
    ("actions: {static: []}", "unknown key static"),
    ("services: {static: [{name: plan, timeout_s: 1}]}", "name must be the full name of a service"),
    ("services: {static: [{name: /plan}]}", "timeout_s must be greater than 0"),
    ("services: {static: [{name: /plan, timeout_s: true}]}", "timeout_s must be greater than 0"),
    ("services: {static: [{name: /plan, timeout_s: 1.0e+6}]}", "and at most 86400"),
    ("topics: {static: [{}]}", "must be a full topic name"),
    ("topics: {static: [{ros1: /a, ros2: /9}]}", "is not a full ROS 2 name"),
    ("topics: {static: [{ros1: /a, direction: up}]}", "expected one of to_ros1, to_ros2, both, got 'up'"),
    ("topics: {static: [{ros1: /a, rate: 0}]}", "rate must be a number greater than zero"),
    ("topics: {static: [{ros1: /a, qos: {depth: -1}}]}", "depth must be a whole number"),
    ("topics: {static: [{ros1: /a, qos: {reliability: x}}]}", "expected one of reliable, best_effort"),
    ("{", "rules.yaml"),
])  # fmt: skip
def test_malformed_rules_raise(text: str, reason: str) -> None:
    with pytest.raises(InvalidRules, match=reason):
        parse_gateway_rules(text, "rules.yaml")


def test_rules_with_types_name_the_topics_that_pass_from_the_start() -> None:
    rules = parse_gateway_rules(
        "topics: {static: [{ros1: /a, ros2: /b, ros1_type: std_msgs/String},"
        " {ros1: /c, direction: to_ros1, ros2_type: std_msgs/msg/String}, {ros1: /d}]}",
        "rules",
    )

    assert rules.from_the_start(Direction.TO_ROS2) == ["/a"]
    assert rules.from_the_start(Direction.TO_ROS1) == ["/b", "/c"]


def test_allow_lists_name_topics_exactly() -> None:
    rules = parse_gateway_rules("topics: {to_ros2: {allow: [/a, /b*]}}", "rules")

    assert rules.names(RuleKind.TOPIC, Direction.TO_ROS2, "/a")
    assert not rules.names(RuleKind.TOPIC, Direction.TO_ROS2, "/b")
    assert not rules.names(RuleKind.TOPIC, Direction.TO_ROS1, "/a")


# The QoS of topics in the form of each engine.


VALUES = {"reliability": Reliability, "durability": Durability, "depth": (0, 1, 10, 42, 1000)}


def test_every_field_of_a_qos_passes_through_every_engine() -> None:
    assert VALUES.keys() == {each.name for each in fields(TopicQos)}
    for values in itertools.product(*VALUES.values()):
        qos = TopicQos(**dict(zip(VALUES, values, strict=True)))

        assert qos_of_dds(dds_qos(qos)) == qos
        assert qos_of_rclpy(json.loads(json.dumps(rclpy_qos(qos)))) == qos
        assert qos_of_zenoh(zenoh_qos(qos)) == qos


@pytest.mark.parametrize(("qos", "text"), [
    (TopicQos(depth=42), "::,:,:,:,,"), (TopicQos(depth=10), "::,10:,:,:,,"),
    (TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1), ":1:,1:,:,:,,"),
    (TopicQos(Reliability.BEST_EFFORT, depth=5), "2::,5:,:,:,,"), (TopicQos(depth=0), "::2,:,:,:,,"),
])  # fmt: skip
def test_qos_has_rmw_zenohs_defaults(qos: TopicQos, text: str) -> None:
    assert zenoh_qos(qos) == text


@pytest.mark.parametrize("text", ["", "x", "9:9:9,-1", "::,99999999999999999999:", "::,\u0663:"])
def test_unknown_qos_counts_as_default(text: str) -> None:
    assert qos_of_zenoh(text) == TopicQos(depth=42)
    assert qos_of_rclpy({"reliability": text, "durability": text}) == TopicQos()


def test_durabilities_that_ros2_lacks_include_transient_local() -> None:
    assert qos_of_dds(Qos(durability=DurabilityKind.PERSISTENT)) == TopicQos(
        durability=Durability.TRANSIENT_LOCAL
    )
