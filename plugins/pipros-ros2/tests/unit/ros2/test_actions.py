"""Actions: definitions, type hashes, conversion, and the messages that all actions share, against rosbags."""

import struct
from functools import partial
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pipros.basics.errors import NotFound
from pipros.msg.language.spec import DefinitionError
from pipros_libraries.actions.status import Status
from pipros_ros2 import action_messages as messages
from pipros_ros2.action_messages import CancelCode, GoalInfo, Ros2Status
from pipros_ros2.ros1_graph import Ros1Topic, actions_of, is_part_of_action
from pipros_rosbag2.conversion.errors import ConversionError, NotConvertible
from pipros_rosbag2.conversion.mapping import parse_rules
from pipros_rosbag2.conversion.plans import Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.action_types import action_of_service
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.parse import parse_ros2_action
from pipros_tools.graph.definitions import Definition
from tests.support.ros2_samples import plans_of

FIBONACCI = "actionlib_tutorials/Fibonacci"
FIBONACCI2 = "example_interfaces/action/Fibonacci"
SEQUENCE = struct.pack("<I3i", 3, 0, 1, 1)
GOAL = bytes(range(16))
INFO = GoalInfo(GOAL, 7_000_000_009)


def rosbags_store(extra: str, name: str) -> Any:
    """Return rosbags' types with one more."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(extra, name))
    return store


def test_results_follow_the_status_of_the_goal() -> None:
    plan = plans_of(Distribution.JAZZY).action(FIBONACCI)
    store = rosbags_store("int8 status\nint32[] sequence\n", "a/msg/Reply")
    reply = store.types["a/msg/Reply"](4, np.array([0, 1, 1], dtype="int32"))

    cdr = plan.result.to_cdr(b"\4" + SEQUENCE)

    assert (plan.ros1_type, plan.ros2_type) == (FIBONACCI, FIBONACCI2)
    assert cdr == bytes(store.serialize_cdr(reply, "a/msg/Reply"))
    assert plan.result.to_ros1(cdr) == b"\4" + SEQUENCE


def test_empty_parts_have_one_byte_in_ros2() -> None:
    plan = plans_of(Distribution.HUMBLE).action("tf2_msgs/LookupTransform")

    assert (plan.feedback.to_cdr(b""), plan.feedback.to_ros1(b"\0\1\0\0\0")) == (b"\0\1\0\0\0", b"")


def test_an_action_of_ros2_determines_the_rule() -> None:
    plans = plans_of(Distribution.JAZZY)
    ros2_type = "action_tutorials_interfaces/action/Fibonacci"

    plan = plans.action(plans.ros1_action(ros2_type), ros2_type)

    assert plan.ros1_type == FIBONACCI
    assert plan.feedback.to_cdr(SEQUENCE) == b"\0\1\0\0" + SEQUENCE


def test_rules_of_the_user_name_actions_and_their_fields(tmp_path: Any) -> None:
    (tmp_path / "my_pkg" / "action").mkdir(parents=True)
    text = "int32 count\n---\nint32[] numbers\n---\nint32[] sequence\n"
    (tmp_path / "my_pkg" / "action" / "Fib.action").write_text(text)
    rules = parse_rules(
        "- {ros1_package_name: actionlib_tutorials, ros1_action_name: Fibonacci,\n"
        "   ros2_package_name: my_pkg, ros2_action_name: Fib,\n"
        "   goal_fields_1_to_2: {order: count}, result_fields_1_to_2: {sequence: numbers}}\n",
        "rules",
    )
    ros1 = installed_definitions()
    plans = Plans(Catalog(Distribution.JAZZY, ros1, [tmp_path]), ros1, rules)

    plan = plans.action(FIBONACCI)

    assert (plan.ros2_type, plan.goal.to_cdr(b"\5\0\0\0")) == ("my_pkg/action/Fib", b"\0\1\0\0\5\0\0\0")
    assert plan.result.to_ros1(b"\0\1\0\0\4\0\0\0" + SEQUENCE) == b"\4" + SEQUENCE


def test_actions_without_a_counterpart_are_errors() -> None:
    plans = plans_of(Distribution.JAZZY)

    with pytest.raises(NotConvertible, match="corresponds to actionlib_tutorials/Averaging"):
        plans.action("actionlib_tutorials/Averaging")
    with pytest.raises(NotConvertible, match="corresponds to no_such/action/Thing"):
        plans.ros1_action("no_such/action/Thing")
    with pytest.raises(NotFound, match="the type no_such/action/Thing"):
        plans.catalog.action("no_such/action/Thing")
    with pytest.raises(DefinitionError, match="expected the parts goal, result, feedback"):
        parse_ros2_action("int32 x\n---\nint32 y\n", "a/action/B")
    with pytest.raises(NotFound, match="is not the type of an action's send_goal service"):
        action_of_service("std_srvs/srv/SetBool")


def test_the_hashes_are_those_of_the_services_and_topics_that_ros2_makes() -> None:
    name = f"{FIBONACCI2}_FeedbackMessage"
    store = rosbags_store(f"unique_identifier_msgs/UUID goal_id\n{FIBONACCI2}_Feedback feedback\n", name)
    store.register(get_types_from_msg("int32[] sequence\n", f"{FIBONACCI2}_Feedback"))

    hashes = plans_of(Distribution.JAZZY).action_hashes(FIBONACCI2)

    assert hashes.feedback == store.hash_rihs01(name)
    assert hashes.status == store.hash_rihs01("action_msgs/msg/GoalStatusArray")
    assert len({hashes.send_goal, hashes.get_result, hashes.cancel_goal, hashes.feedback}) == 4


def test_goals_and_feedback_follow_the_id() -> None:
    cdr = messages.with_id(GOAL, b"\0\1\0\0\5\0\0\0")

    assert cdr == b"\0\1\0\0" + GOAL + b"\5\0\0\0"
    assert messages.split_id(cdr) == (GOAL, b"\0\1\0\0\5\0\0\0")


def test_statuses_and_cancellations_equal_those_of_rosbags() -> None:
    store = rosbags_store("int8 return_code\naction_msgs/GoalInfo[] goals_canceling\n", "a/msg/Reply")
    types = store.types
    time = types["builtin_interfaces/msg/Time"](7, 9)
    uuid = types["unique_identifier_msgs/msg/UUID"](np.frombuffer(GOAL, "uint8"))
    info = types["action_msgs/msg/GoalInfo"](uuid, time)
    status = [types["action_msgs/msg/GoalStatus"](info, each) for each in (2, 6)]
    array = types["action_msgs/msg/GoalStatusArray"](status)
    rows = [(INFO, Ros2Status.EXECUTING), (INFO, Ros2Status.ABORTED)]

    encoded = messages.status_array(rows)

    assert encoded == bytes(store.serialize_cdr(array, "action_msgs/msg/GoalStatusArray"))
    assert messages.parse_status_array(encoded, 2) == rows
    assert messages.parse_status_array(messages.status_array([]), 2) == []
    request = bytes(store.serialize_cdr(info, "action_msgs/msg/GoalInfo"))
    assert (messages.cancel_request(INFO), messages.parse_cancel_request(request)) == (request, INFO)
    reply = bytes(store.serialize_cdr(types["a/msg/Reply"](3, [info]), "a/msg/Reply"))
    assert messages.cancel_reply(CancelCode.GOAL_TERMINATED, [INFO]) == reply
    assert messages.accepted_reply(INFO.stamp_ns, is_accepted=True) == b"\0\1\0\0\1\0\0\0" + request[20:]
    assert [messages.is_accepted(b"\0\1\0\0" + end) for end in (b"\1", b"\0")] == [True, False]


def test_statuses_beyond_the_limit_are_not_parsed() -> None:
    rows = [(GoalInfo(bytes([each]) * 16), Ros2Status.EXECUTING) for each in range(5)]
    array = messages.status_array(rows)

    assert messages.parse_status_array(memoryview(array), 3) == rows[:3]
    assert messages.parse_status_array(array + b"\0", 5) == rows
    assert messages.parse_status_array(array, 0) == []


def test_messages_that_are_too_short_are_errors() -> None:
    lying = b"\0\1\0\0" + b"\xff" * 8
    for parse, cdr in (
        (messages.split_id, b"\0\1\0\0" + GOAL[:15]),
        (messages.split_id, b"\0\0\0\0" + GOAL),
        (messages.is_accepted, b""),
        (messages.parse_cancel_request, messages.cancel_request(INFO)[:-1]),
        (partial(messages.parse_status_array, limit=9), lying),
    ):
        with pytest.raises(ConversionError, match="expected little-endian CDR with at least"):
            parse(cdr)


def test_unknown_statuses_and_negative_times_do_not_count() -> None:
    array = bytearray(messages.status_array([(INFO, Ros2Status.ACCEPTED)]))
    array[24:28] = b"\xff" * 4

    assert messages.parse_status_array(bytes(array), 2)[0][0] == GoalInfo(GOAL, 9)
    array[-1] = 77
    assert messages.parse_status_array(bytes(array), 2) == []


def test_ids_survive_both_ways() -> None:
    assert messages.id_in_ros2(messages.id_in_ros1(GOAL)) == GOAL
    foreign = messages.id_in_ros2("/client-1-12.345")
    assert foreign == messages.id_in_ros2("/client-1-12.345") != messages.id_in_ros2("/client-2-12.345")
    assert messages.id_in_ros2(messages.id_in_ros1(GOAL).upper()) != GOAL


def test_every_status_has_a_counterpart() -> None:
    assert messages.TO_ROS2.keys() == set(Status)
    assert messages.TO_ROS1.keys() == set(Ros2Status)
    assert {status for status in Ros2Status if status.has_ended} == {
        Ros2Status.SUCCEEDED, Ros2Status.CANCELED, Ros2Status.ABORTED
    }  # fmt: skip


def topic(kind: str, *publishers: str) -> Ros1Topic:
    return Ros1Topic(Definition(kind, "", ""), is_latched=False, publishers=publishers)


def test_actions_of_ros1_are_found_by_their_topics() -> None:
    topics = {
        "/fib/status": topic("actionlib_msgs/GoalStatusArray", "/server"),
        "/fib/result": topic("actionlib_tutorials/FibonacciActionResult", "/server"),
        "/odd/status": topic("actionlib_msgs/GoalStatusArray", "/server"),
        "/odd/result": topic("std_msgs/String", "/server"),
        "/gone/status": topic("actionlib_msgs/GoalStatusArray", "/server"),
        "/gone/result": topic("actionlib_tutorials/FibonacciActionResult", "/other"),
    }

    found = actions_of(topics, {"/fib/goal": ["/server"], "/gone/goal": ["/server"]})

    assert found == {"/fib": FIBONACCI}


@pytest.mark.parametrize(("name", "kind", "is_part"), [
    ("/fib/goal", "actionlib_tutorials/FibonacciActionGoal", True),
    ("/fib/cancel", "actionlib_msgs/GoalID", True), ("/fib/status", "actionlib_msgs/GoalStatusArray", True),
    ("/goals", "actionlib_tutorials/FibonacciActionGoal", False),
    ("/fib/goal", "geometry_msgs/PoseStamped", False), ("/status", "std_msgs/String", False),
])  # fmt: skip
def test_topics_of_actions_do_not_pass_as_topics(name: str, kind: str, is_part: bool) -> None:
    assert is_part_of_action(name, kind) is is_part
