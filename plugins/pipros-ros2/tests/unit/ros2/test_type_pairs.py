"""The type pairs of a gateway: installed types, received definitions, services, actions and hashes."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from pipros.basics.errors import LimitExceeded, NotFound
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros_ros2.action_messages import Ros2Status
from pipros_ros2.rules import Direction, StaticRule
from pipros_ros2.type_pairs import TypePairs, WrongHash
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES, ActionRule, MappingRules, MessageRule
from pipros_rosbag2.distribution import Distribution
from pipros_tools.graph.definitions import Definition
from tests.support.constants import Constants

LIMITS = process_limits()
PAIRS = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
HUMBLE = TypePairs(Distribution.HUMBLE, BUILTIN_RULES)
POSE = Definition(
    "my_msgs/Pose", "0" * 32, "my_msgs/Part part\n" + "=" * 80 + "\nMSG: my_msgs/Part\nint8 x\n"
)


def rule(ros1_type: str = "", ros2_type: str = "") -> StaticRule:
    return StaticRule("/a", "/a", frozenset(Direction), ros1_type, ros2_type)


def test_types_have_the_same_pair_from_both_sides() -> None:
    string = load_message_class("std_msgs/String")
    pair = PAIRS.of_ros1(Definition("std_msgs/String", string._md5sum, string._full_text))

    assert pair is PAIRS.of_ros2("std_msgs/msg/String")
    assert pair is PAIRS.of_rule(rule(ros1_type="std_msgs/String"))
    assert pair is PAIRS.of_rule(rule(ros2_type="std_msgs/msg/String"))
    assert (pair.raw._type, pair.raw._md5sum) == ("std_msgs/String", string._md5sum)
    assert pair.type_hash.startswith("RIHS01_")
    assert HUMBLE.of_ros2("std_msgs/msg/String").type_hash == ""


def test_received_definitions_are_used_for_types_that_are_not_installed() -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
    with pytest.raises(NotFound, match="the ROS 1 type no_msgs/Such is not installed"):
        pairs.of_rule(rule(ros1_type="no_msgs/Such"))

    pair = pairs.of_ros1(POSE)

    assert (pair.plan.ros2_type, pair.plan.to_cdr(b"\7")) == ("my_msgs/msg/Pose", b"\0\1\0\0\7")
    assert pairs.of_ros2("my_msgs/msg/Pose") is pair


def test_installed_types_that_ros2_may_lack_are_derived_where_nodes_announce_hashes() -> None:
    found = load_message_class("tf2_web_republisher/TFArray")
    definition = Definition("tf2_web_republisher/TFArray", found._md5sum, found._full_text)

    pair = PAIRS.of_ros1(definition)

    assert pair.plan.ros2_type == "tf2_web_republisher/msg/TFArray"
    assert PAIRS.of_ros2("tf2_web_republisher/msg/TFArray") is pair
    with pytest.raises(WrongHash):
        PAIRS.check_hash(pair.plan.ros2_type, {pair.type_hash}, "RIHS01_" + "0" * 64)
    action = PAIRS.of_action("tf2_web_republisher/TFSubscription")
    assert action.plan.ros2_type == "tf2_web_republisher/action/TFSubscription"
    with pytest.raises(ConversionError, match="no type in ROS 2 humble corresponds"):
        HUMBLE.of_ros1(definition)


def test_definitions_in_a_folder_precede_derived_ones(tmp_path: Path) -> None:
    file = tmp_path / "control_interfaces" / "msg" / "JointTolerance.msg"
    file.parent.mkdir(parents=True)
    file.write_text("string name\n")
    found = load_message_class("control_msgs/JointTolerance")
    definition = Definition("control_msgs/JointTolerance", found._md5sum, found._full_text)

    assert PAIRS.of_ros1(definition).plan.ros2_type == "control_msgs/msg/JointTolerance"
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES, [tmp_path])
    assert pairs.of_ros1(definition).plan.ros2_type == "control_interfaces/msg/JointTolerance"


def test_received_definitions_have_a_limit(constants: Constants) -> None:
    constants(ROS2_DEFINITION_BYTES=10)
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)

    with pytest.raises(LimitExceeded, match="too many received definitions"):
        pairs.of_ros1(POSE)


def test_types_that_are_only_in_ros2_need_a_package_of_ros1() -> None:
    rules = MappingRules((MessageRule("my_msgs/Part", "std_msgs/msg/Int8", {"x": "data"}),))
    pairs = TypePairs(Distribution.JAZZY, rules)
    pairs.of_ros1(POSE)

    with pytest.raises(NotFound, match="the ROS 1 type my_msgs/Part is not installed"):
        pairs.of_ros2("std_msgs/msg/Int8")


def test_another_hash_is_an_error_unless_types_are_forced() -> None:
    pair = PAIRS.of_ros2("std_msgs/msg/String")

    kind, hashes = pair.plan.ros2_type, {pair.type_hash}
    PAIRS.check_hash(kind, hashes, pair.type_hash)
    PAIRS.check_hash(kind, hashes, "")
    PAIRS.check_hash(kind, {""}, "RIHS01_0")
    with pytest.raises(WrongHash, match="definition of std_msgs/msg/String differs: expected the hash"):
        PAIRS.check_hash(kind, hashes, "RIHS01_0")
    lenient = TypePairs(Distribution.JAZZY, BUILTIN_RULES, is_lenient=True)
    lenient.check_hash(kind, hashes, "RIHS01_0")


def test_services_have_the_hashes_of_their_parts() -> None:
    pair = PAIRS.of_ros2_service("std_srvs/srv/SetBool")

    assert pair.plan is PAIRS.of_service("std_srvs/SetBool").plan
    hashes = {pair.type_hash, pair.parts.request, pair.parts.response}
    assert len(hashes) == 3
    assert all(each.startswith("RIHS01_") for each in hashes)
    assert HUMBLE.of_service("std_srvs/SetBool").type_hash == ""


def test_actions_convert_goals_feedback_and_results() -> None:
    pair = PAIRS.of_action("actionlib_tutorials/Fibonacci")
    goal, feedback, result = (
        load_message_class(f"actionlib_tutorials/Fibonacci{part}") for part in ("Goal", "Feedback", "Result")
    )

    assert pair is PAIRS.of_ros2_action("example_interfaces/action/Fibonacci")
    assert pair.goal_to_ros1(pair.goal_to_cdr(goal(5))) == goal(5)
    assert pair.feedback_to_ros1(pair.feedback_to_cdr(feedback([1, 2]))) == feedback([1, 2])
    reply = pair.result_to_cdr(Ros2Status.CANCELED, result([3]))
    assert pair.result_to_ros1(reply) == (Ros2Status.CANCELED, result([3]))
    assert pair.result_to_ros1(pair.result_to_cdr(Ros2Status.UNKNOWN)) == (Ros2Status.UNKNOWN, result())
    assert pair.empty_result() == result()
    with pytest.raises(ConversionError, match="unknown goal status 9"):
        pair.result_to_ros1(b"\0\1\0\0" + struct.pack("<b3xI", 9, 0))
    assert HUMBLE.of_action("actionlib_tutorials/Fibonacci").hashes.send_goal == ""


FIBONACCI = "actionlib_tutorials/Fibonacci"
DEMOS = ["example_interfaces/action/Fibonacci", "action_tutorials_interfaces/action/Fibonacci"]


@pytest.mark.parametrize(
    ("distribution", "names"),
    [(Distribution.HUMBLE, DEMOS), (Distribution.JAZZY, DEMOS), (Distribution.LYRICAL, DEMOS[:1])],
)
def test_an_action_has_all_names_of_its_distribution(distribution: Distribution, names: list[str]) -> None:
    pairs = TypePairs(distribution, BUILTIN_RULES).all_of_action(FIBONACCI)

    assert [each.plan.ros2_type for each in pairs] == names


def test_a_rule_of_the_user_replaces_the_names_of_an_action() -> None:
    rules = MappingRules(
        actions=(ActionRule(FIBONACCI, DEMOS[1], feedback={"sequence": "partial_sequence"}),)
    )
    pairs = TypePairs(Distribution.JAZZY, rules.and_then(BUILTIN_RULES)).all_of_action(FIBONACCI)

    assert [each.plan.ros2_type for each in pairs] == DEMOS[1:]
