"""The type pairs of a gateway: installed types, received definitions, services, actions and hashes."""

import struct
from pathlib import Path

import pytest

from pipros.basics.errors import LimitExceeded, NotFound
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.msg.language.spec import DefinitionError
from pipros_ros2.action_messages import Ros2Status
from pipros_ros2.rtps.announcements import entries
from pipros_ros2.rtps.graph_info import TYPE_HASH
from pipros_ros2.rules import Direction, StaticRule
from pipros_ros2.type_pairs import TypePairs, WrongHash
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES, ActionRule, MappingRules, MessageRule
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import carried
from pipros_rosbag2.interfaces.parse import parse_ros2_message
from pipros_rosbag2.interfaces.spec import Ros2Message
from pipros_rosbag2.interfaces.type_hash import message_hash
from pipros_tools.graph.definitions import Definition
from tests.support.constants import Constants
from tests.support.ros2_samples import plans_of, store_of

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


@pytest.mark.parametrize(("distribution", "names"), [
    (Distribution.HUMBLE, DEMOS), (Distribution.JAZZY, DEMOS), (Distribution.LYRICAL, DEMOS[:1])
])  # fmt: skip
def test_an_action_has_all_names_of_its_distribution(distribution: Distribution, names: list[str]) -> None:
    pairs = TypePairs(distribution, BUILTIN_RULES).all_of_action(FIBONACCI)

    assert [each.plan.ros2_type for each in pairs] == names


def test_a_rule_of_the_user_replaces_the_names_of_an_action() -> None:
    rules = MappingRules(
        actions=(ActionRule(FIBONACCI, DEMOS[1], feedback={"sequence": "partial_sequence"}),)
    )
    pairs = TypePairs(Distribution.JAZZY, rules.and_then(BUILTIN_RULES)).all_of_action(FIBONACCI)

    assert [each.plan.ros2_type for each in pairs] == DEMOS[1:]


# Type hashes against published ones, and against rosbags for every carried type.


STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD_TWO_INTS = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
"""Both are in the design document of rmw_zenoh."""

WITH_CHAR = {
    "std_msgs/msg/Char", "rmw_dds_common/msg/Gid", "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo", "service_msgs/msg/ServiceEventInfo",
}  # fmt: skip
"""rosbags gives `char` the number 13. That of uint8 gives the published hash of AddTwoInts."""


def test_hashes_equal_the_published_ones() -> None:
    plans = plans_of(Distribution.JAZZY)

    assert plans.message_hash("std_msgs/msg/String") == STRING
    assert plans.service_hash("example_interfaces/srv/AddTwoInts") == ADD_TWO_INTS


def test_the_topic_with_the_nodes_has_its_hash() -> None:
    found = plans_of(Distribution.JAZZY).message_hash("rmw_dds_common/msg/ParticipantEntitiesInfo")

    assert entries(TYPE_HASH) == {"typehash": found}


@pytest.mark.parametrize("distribution", Distribution)
def test_hashes_of_all_types_equal_those_of_rosbags(distribution: Distribution) -> None:
    store, plans = store_of(distribution), plans_of(distribution)
    names = (carried(distribution).messages & store.fielddefs.keys()) - WITH_CHAR

    assert len(names) > 120
    assert {name: plans.message_hash(name) for name in names} == {
        name: store.hash_rihs01(name) for name in names
    }


@pytest.mark.parametrize("distribution", Distribution)
def test_carried_constants_equal_those_of_rosbags(distribution: Distribution) -> None:
    store, catalog = store_of(distribution), plans_of(distribution).catalog
    for name in carried(distribution).messages & store.fielddefs.keys():
        constants, _ = store.fielddefs[name]
        ours = [(each.name, each.type, each.text.strip("\"'")) for each in catalog.message(name).constants]
        assert ours == [(constant, kind, str(value)) for constant, kind, value in constants], name


def test_defaults_and_comments_do_not_change_the_hash() -> None:
    plain = parse_ros2_message("int32 x\nstring<=5 s\nuint8[<=3] b", "a/msg/B")
    rich = parse_ros2_message('int32 x 5 # metres\nstring<=5 s "a # b"\nuint8[<=3] b [1, 2]', "a/msg/B")

    assert message_hash(plain, _unknown) == message_hash(rich, _unknown)


def test_a_type_that_contains_itself_has_no_hash() -> None:
    message = parse_ros2_message("B[] b", "a/msg/B")

    with pytest.raises(DefinitionError, match="cannot contain itself: a/msg/B"):
        message_hash(message, lambda _: message)


def _unknown(name: str) -> Ros2Message:
    raise NotFound(name)
