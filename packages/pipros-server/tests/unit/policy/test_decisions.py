"""Decisions: nothing outside a policy is allowed, whatever names, types and values clients send."""

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.msg import load_message_class, load_service_class
from pipros_server.policy.decisions import Act, PolicyState, decide, read_condition
from pipros_server.policy.field_check import POLICY_VALUES
from pipros_server.policy.model import ActKind, ActRefused
from pipros_server.policy.policy_file import parse_policy

Twist: Any = load_message_class("geometry_msgs/Twist")
Vector3: Any = load_message_class("geometry_msgs/Vector3")
BASE = parse_policy(
    """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}, angular.z: {range: [-1, 1], unit: rad/s}}
""",
    "base.yaml",
)


def publish(name: str, message: Any) -> Act:
    return Act(ActKind.TOPIC, name, message, message._type, message._md5sum)


def twist(x: float = 0.0, y: float = 0.0, turn: float = 0.0) -> Any:
    return Twist(Vector3(x, y, 0.0), Vector3(0.0, 0.0, turn))


def refusal(policy: Any, act: Act, state: PolicyState | None = None, now_s: float = 0.0) -> str:
    with pytest.raises(ActRefused) as caught:
        decide(policy, act, state or PolicyState(), now_s)
    return str(caught.value)


ANY_FLOAT = st.floats() | st.sampled_from(
    [0.3, -0.3, math.nextafter(0.3, 1), math.nextafter(-0.3, -1), 1.0, -0.0]
)


@given(values=st.lists(ANY_FLOAT, min_size=6, max_size=6))
def test_only_values_inside_all_ranges_pass(values: list[float]) -> None:
    message = Twist(Vector3(*values[:3]), Vector3(*values[3:]))
    inside = (
        -0.3 <= values[0] <= 0.3 and not any(value != 0 for value in values[1:5]) and -1 <= values[5] <= 1
    )
    try:
        decide(BASE, publish("/cmd_vel", message), PolicyState(), 0.0)
        allowed = True
    except ActRefused:
        allowed = False
    assert allowed is inside


@given(
    name=st.text(max_size=12)
    | st.sampled_from(["/cmd_v\u0435l", "/cmd_vel/", "//cmd_vel", "cmd_vel", "/CMD_VEL"])
)
def test_a_name_that_the_policy_does_not_have_is_refused(name: str) -> None:
    if name != "/cmd_vel":
        text = refusal(BASE, publish(name, twist()))
        assert text.startswith("the policy has no rule for the topic")
        assert text.isascii()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 0.31, -0.31, math.nextafter(0.3, 1)])
def test_values_beyond_the_edge_nan_and_infinity_are_refused(value: float) -> None:
    text = refusal(BASE, publish("/cmd_vel", twist(value)))
    assert "linear.x of /cmd_vel must be" in text
    assert "base.yaml:4: topics./cmd_vel.fields.linear.x" in text


def test_a_field_without_a_rule_must_be_zero() -> None:
    assert "linear.y of /cmd_vel has no rule" in refusal(BASE, publish("/cmd_vel", twist(y=0.1)))
    assert "linear.y of /cmd_vel has no rule" in refusal(BASE, publish("/cmd_vel", twist(y=math.nan)))


def test_another_type_and_another_definition_are_refused() -> None:
    act = publish("/cmd_vel", load_message_class("std_msgs/String")())
    assert "must have the type geometry_msgs/Twist, got std_msgs/String" in refusal(BASE, act)
    other = Act(ActKind.TOPIC, "/cmd_vel", twist(), Twist._type, "0" * 32)
    assert "the definition of geometry_msgs/Twist differs" in refusal(BASE, other)


def test_a_rule_for_a_topic_allows_neither_a_service_nor_a_parameter() -> None:
    assert "has no rule for the service" in refusal(
        BASE, Act(ActKind.SERVICE, "/cmd_vel", twist(), Twist._type, Twist._md5sum)
    )
    assert "has no rule for the parameter" in refusal(BASE, Act(ActKind.PARAMETER, "/cmd_vel", 1))


def test_the_limit_of_a_32_bit_field_is_the_nearest_number_with_32_bits() -> None:
    policy = parse_policy("topics: {/f: {type: std_msgs/Float32, fields: {data: {range: [0, 0.3]}}}}", "p")
    float32: Any = load_message_class("std_msgs/Float32")
    (single,) = struct.unpack("<f", struct.pack("<f", 0.3))
    for edge in (0.3, single):
        decide(policy, publish("/f", float32(edge)), PolicyState(), 0.0)
    assert "must be from 0 to 0.3" in refusal(policy, publish("/f", float32(0.3000001)))
    assert "must be a finite number" in refusal(policy, publish("/f", float32(1e300)))


RATES = parse_policy(
    """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-2, 2], change_per_s: 0.5}}
    per_minute: 3
    stop: zero
""",
    "rates.yaml",
)


def test_a_change_is_limited_by_the_time_since_the_last_message_and_never_by_more_than_a_second() -> None:
    state = PolicyState()
    assert "may change by at most 0.5 per second, got 0.6 after 0" in refusal(
        RATES, publish("/cmd_vel", twist(0.6))
    )
    decide(RATES, publish("/cmd_vel", twist(0.5)), state, 100.0)
    assert "after 0.5" in refusal(RATES, publish("/cmd_vel", twist(0.75)), state, 100.4)
    decide(RATES, publish("/cmd_vel", twist(0.75)), state, 100.5)
    assert "after 0.75" in refusal(RATES, publish("/cmd_vel", twist(1.3)), state, 500.0)


def test_a_stop_always_passes_and_the_next_change_begins_there() -> None:
    state = PolicyState()
    for now_s, speed in ((0.0, 0.5), (1.0, 1.0), (2.0, 1.5)):
        decide(RATES, publish("/cmd_vel", twist(speed)), state, now_s)
    assert "the limit of 3 per minute" in refusal(RATES, publish("/cmd_vel", twist(1.4)), state, 2.2)
    decide(RATES, publish("/cmd_vel", twist()), state, 2.2)
    assert "after 0 " in refusal(RATES, publish("/cmd_vel", twist(1.4)), state, 61.5)
    decide(RATES, publish("/cmd_vel", twist(0.5)), state, 61.5)


JOINTS = parse_policy(
    """\
topics:
  /arm:
    type: trajectory_msgs/JointTrajectory
    fields: {"points[]": {count: 2}, "points[].positions[]": {range: [-2, 2], change_per_s: 0.5}}
    stop: zero
""",
    "joints.yaml",
)


def joints(*positions: float) -> Any:
    point: Any = load_message_class("trajectory_msgs/JointTrajectoryPoint")
    trajectory: Any = load_message_class("trajectory_msgs/JointTrajectory")
    return trajectory(points=[point(positions=list(positions))] if positions else [])


@pytest.mark.parametrize("policy", [JOINTS, parse_policy(JOINTS.text.replace("    stop: zero\n", ""), "p")])
def test_a_message_without_an_element_does_not_let_the_next_one_jump(policy: Any) -> None:
    state = PolicyState()
    for now_s, position in ((0.0, 0.5), (1.0, 1.0), (2.0, 1.5)):
        decide(policy, publish("/arm", joints(position)), state, now_s)
    decide(policy, publish("/arm", joints()), state, 3.0)
    assert "got 0 after 1.5" in refusal(policy, publish("/arm", joints(0.0)), state, 4.0)
    decide(policy, publish("/arm", joints(1.2)), state, 4.0)


def test_elements_whose_change_is_limited_do_not_accumulate_without_end() -> None:
    state, most = PolicyState(), POLICY_VALUES
    decide(JOINTS, publish("/arm", joints(*[0.0] * (most - 20))), state, 0.0)
    wide = joints(0.0, 0.0)
    wide.points = [*joints(0.0).points, *joints(*[0.0] * 100).points]
    assert "fields or elements with change_per_s would be stored" in refusal(
        JOINTS, publish("/arm", wide), state, 1.0
    )


def test_after_the_time_limit_a_change_begins_at_the_stop() -> None:
    fields = "fields: {linear.x: {change_per_s: 1}}"
    text = f"topics: {{/cmd_vel: {{type: geometry_msgs/Twist, time_limit_s: 0.5, {fields}}}}}"
    policy, state = parse_policy(text, "p"), PolicyState()
    decide(policy, publish("/cmd_vel", twist(1.0)), state, 10.0)
    decide(policy, publish("/cmd_vel", twist(1.4)), state, 10.4)
    assert "got 1.5 after 0 " in refusal(policy, publish("/cmd_vel", twist(1.5)), state, 11.0)


def test_before_the_first_message_nothing_was_stopped_and_a_change_begins_at_start() -> None:
    fields = "fields: {linear.x: {change_per_s: 1, start: 5}}"
    text = f"topics: {{/cmd_vel: {{type: geometry_msgs/Twist, time_limit_s: 0.5, {fields}}}}}"
    policy, state = parse_policy(text, "p"), PolicyState()
    assert "got 0.5 after 5 " in refusal(policy, publish("/cmd_vel", twist(0.5)), state, 10.0)
    decide(policy, publish("/cmd_vel", twist(5.5)), state, 10.0)


@given(gaps=st.lists(st.floats(min_value=0, max_value=40), max_size=30))
def test_no_minute_has_more_acts_than_the_policy_allows(gaps: list[float]) -> None:
    policy = parse_policy("services: {/reset: {type: std_srvs/Empty, per_minute: 3}}", "p")
    service: Any = load_service_class("std_srvs/Empty")
    state, now_s, passed = PolicyState(), 0.0, []
    for gap in gaps:
        now_s += gap
        try:
            act = Act(ActKind.SERVICE, "/reset", service._request_class(), service._type, service._md5sum)
            decide(policy, act, state, now_s)
            passed.append(now_s)
        except ActRefused:
            assert sum(now_s - 60 < each for each in passed) == 3
    assert all(sum(begin <= each < begin + 60 for each in passed) <= 3 for begin in passed)


ARM = parse_policy(
    """\
topics:
  /arm:
    type: trajectory_msgs/JointTrajectory
    fields:
      joint_names[]: {one_of: [shoulder, elbow], count: 2}
      points[]: {count: 3}
      points[].positions[]: {range: [-90, 90], unit: deg, count: 2}
      points[].positions[1]: {range: [0, 45], unit: deg}
      points[].time_from_start: {range: [0.5, 10], unit: s}
""",
    "arm.yaml",
)


def trajectory(positions: list[float], seconds: float = 1.0, points: int = 1, name: str = "elbow") -> Any:
    message: Any = load_message_class("trajectory_msgs/JointTrajectory")()
    point: Any = load_message_class("trajectory_msgs/JointTrajectoryPoint")()
    point.positions = positions
    point.time_from_start = type(point.time_from_start)(seconds)
    message.joint_names = ["shoulder", name]
    message.points = [point] * points
    return message


def test_elements_of_arrays_have_the_rule_of_their_index_or_that_of_all() -> None:
    decide(ARM, publish("/arm", trajectory([-1.5, 0.7])), PolicyState(), 0.0)
    cases = {
        "points[0].positions[1] of /arm must be from 0 to 45 deg, got -45.8366 deg": trajectory([0.7, -0.8]),
        "points[0].positions[0] of /arm must be from -90 to 90 deg, got -91.6": trajectory([-1.6, 0.7]),
        "points[0].positions[0] of /arm must be from -90 to 90 deg": trajectory([1.6, 0.7]),
        "points[0].positions of /arm may have at most 2 elements, got 3": trajectory([0.0, 0.0, 0.0]),
        "points of /arm may have at most 3 elements, got 4": trajectory([0.0, 0.0], points=4),
        "points[0].time_from_start of /arm must be from 0.5 to 10 s, got 0.1 s": trajectory([0.0, 0.0], 0.1),
        "joint_names[1] of /arm must be one of 'shoulder', 'elbow'; got 'wr\\u0456st'": trajectory(
            [0.0], name="wr\u0456st"
        ),
    }
    for expected, message in cases.items():
        assert expected in refusal(ARM, publish("/arm", message))
    fast = trajectory([0.0, 0.0])
    fast.points[0].velocities = [0.0]
    assert "points[0].velocities of /arm has no rule and must be empty" in refusal(ARM, publish("/arm", fast))


def test_a_message_with_more_values_than_are_compared_is_refused() -> None:
    policy = parse_policy(
        "topics: {/s: {type: sensor_msgs/JointState, fields: {'position[]': {range: [0, 1]}}}}", "p"
    )
    state: Any = load_message_class("sensor_msgs/JointState")()
    most = POLICY_VALUES
    state.position = [0.5] * (most - 100)
    decide(policy, publish("/s", state), PolicyState(), 0.0)
    state.position = [0.5] * most
    assert f"/s has too many values to compare; the limit is {most}" in refusal(policy, publish("/s", state))


def test_a_launch_file_has_the_arguments_of_its_rule() -> None:
    policy = parse_policy(
        "launch_files: {my_robot/base.launch: {time_limit_s: 9, per_minute: 1, args: {"
        "speed: {range: [0, 1]}, map: {one_of: [room, hall]}, fast: {one_of: [true]}}}}\n"
        "recordings: {/scan: {time_limit_s: 9}}",
        "p",
    )

    def launch(name: str = "my_robot/base.launch", **arguments: Any) -> Act:
        return Act(ActKind.LAUNCH, name, arguments)

    decide(policy, launch(speed=1, map="hall", fast=True), PolicyState(), 0.0)
    decide(policy, Act(ActKind.RECORD, "/scan", {}), PolicyState(), 0.0)
    for wrong, text in (
        (launch(speed=1.5), "speed of my_robot/base.launch must be from 0 to 1"),
        (launch(speed="1"), "must be a number"),
        (launch(speed=math.nan), "must be a finite number"),
        (launch(map="$(env HOME)"), "must be one of 'room', 'hall'"),
        (launch(fast=1), "must be one of True"),
        (launch(rate=1), "no rule for the argument 'rate'"),
        (launch("my_robot/../base.launch"), "has no rule for the launch_file"),
        (Act(ActKind.RECORD, "/image", {}), "has no rule for the recording /image"),
        (Act(ActKind.TOPIC, "/scan", {}), "has no rule for the topic /scan"),
    ):
        assert text in refusal(policy, wrong)
    state = PolicyState()
    decide(policy, launch(), state, 0.0)
    assert "exceeds the limit of 1 per minute" in refusal(policy, launch(), state, 1.0)


@pytest.mark.parametrize(("value", "message"), [
    (0.5, ""), (1, ""), (1.5, "/speed must be from 0 to 1 m/s, got 1.5 m/s"),
    (math.nan, "/speed must be a finite number"), (True, "/speed must have the type double, got True"),
    ({"a": 1}, "/speed must have the type double"),
])  # fmt: skip
def test_parameters_have_types_and_ranges(value: object, message: str) -> None:
    policy = parse_policy("parameters: {/speed: {type: double, range: [0, 1], unit: m/s}}", "p")
    act = Act(ActKind.PARAMETER, "/speed", value)
    if message:
        assert message in refusal(policy, act)
    else:
        decide(policy, act, PolicyState(), 0.0)


GUARDED = parse_policy(
    """\
services: {/go: {type: std_srvs/Empty, requires: [dead_man, battery]}}
conditions:
  dead_man: {topic: /joy, type: sensor_msgs/Joy, field: "buttons[1]", one_of: [1], max_age_s: 0.5}
  battery: {topic: /level, type: std_msgs/Float32, field: data, above: 20, unit: "%", max_age_s: 10}
""",
    "guarded.yaml",
)


def test_an_act_needs_conditions_that_hold_and_messages_that_are_new_enough() -> None:
    service: Any = load_service_class("std_srvs/Empty")
    act = Act(ActKind.SERVICE, "/go", service._request_class(), service._type, service._md5sum)
    state = PolicyState()
    joy: Any = load_message_class("sensor_msgs/Joy")
    level: Any = load_message_class("std_msgs/Float32")

    def read(name: str, message: Any, now_s: float) -> None:
        state.readings[name] = read_condition(GUARDED.conditions[name], message, now_s)

    assert "dead_man does not hold: no message on /joy yet" in refusal(GUARDED, act, state, 1.0)
    read("battery", level(0.5), 1.0)
    read("dead_man", joy(buttons=[0, 1]), 1.0)
    decide(GUARDED, act, state, 1.5)
    assert "the last message on /joy is 0.6 s old, at most 0.5 s" in refusal(GUARDED, act, state, 1.6)
    read("dead_man", joy(buttons=[1, 0]), 2.0)
    assert "must be one of 1; got 0" in refusal(GUARDED, act, state, 2.0)
    with pytest.raises(ActRefused) as caught:
        decide(GUARDED, act, state, 2.0)
    assert caught.value.place == GUARDED.conditions["dead_man"].place != ""
    read("dead_man", joy(buttons=[1]), 2.0)
    assert "the message on /joy has no 1" in refusal(GUARDED, act, state, 2.0)
    read("dead_man", joy(buttons=[0, 1]), 2.0)
    for bad in (0.1, math.nan, math.inf):
        read("battery", level(bad), 2.0)
        assert "the condition battery does not hold" in refusal(GUARDED, act, state, 2.0)


@pytest.mark.parametrize(("fields", "inside", "outside"), [
    (("points[]: any", "points[1].positions[0]: {range: [0, 1]}"), [[9], [1]], [[9], [2]]),
    (("points[].positions[]: any", "points[].positions[1]: {range: [0, 1]}"), [[9, 1]], [[9, 2]]),
    (("points: any", "points[].positions[0]: {range: [0, 1]}"), [[1, 9], [0, 9]], [[0, 9], [2, 9]]),
])  # fmt: skip
def test_any_does_not_lift_the_rules_of_elements(fields: Any, inside: Any, outside: Any) -> None:
    text = "topics:\n  /arm:\n    type: trajectory_msgs/JointTrajectory\n    fields:\n      "
    policy = parse_policy(text + "\n      ".join(fields), "arm.yaml")
    trajectory: Any = load_message_class("trajectory_msgs/JointTrajectory")
    point: Any = load_message_class("trajectory_msgs/JointTrajectoryPoint")

    def arm(points: Any) -> Act:
        return publish("/arm", trajectory(points=[point(positions=each) for each in points]))

    decide(policy, arm(inside), PolicyState(), 0.0)
    assert "must be from 0 to 1" in refusal(policy, arm(outside))


def test_any_for_a_field_does_not_lift_the_rule_of_a_field_below_it() -> None:
    policy = parse_policy(
        "topics:\n  /cmd_vel:\n    type: geometry_msgs/Twist\n"
        "    fields: {linear: any, linear.x: {range: [0, 1]}}\n",
        "any.yaml",
    )
    decide(policy, publish("/cmd_vel", twist(1, 99)), PolicyState(), 0.0)
    assert "linear.x of /cmd_vel must be from 0 to 1" in refusal(policy, publish("/cmd_vel", twist(2)))


def test_parameters_without_a_range_may_have_any_value_of_their_type() -> None:
    policy = parse_policy(
        "parameters:\n  /on: {type: bool}\n  /mode: {type: str}\n  /gain: {type: double}\n", "any.yaml"
    )
    for name, value in (("/on", True), ("/on", False), ("/mode", "slow"), ("/gain", 2)):
        decide(policy, Act(ActKind.PARAMETER, name, value), PolicyState(), 0.0)
    for name, value in (("/on", 1), ("/on", "yes"), ("/mode", 1), ("/mode", {}), ("/gain", math.inf)):
        assert "must" in refusal(policy, Act(ActKind.PARAMETER, name, value))


QUATERNION_POLICY = """\
topics:
  /any: {type: geometry_msgs/PoseStamped, fields: any}
  /part: {type: geometry_msgs/PoseStamped, fields: {pose.orientation: any}}
  /parts:
    type: geometry_msgs/PoseStamped
    fields: {pose.orientation.z: {range: [-1, 1]}, pose.orientation.w: {range: [-1, 1]}}
  /poses: {type: geometry_msgs/PoseArray, fields: {'poses[]': any}}
"""


@pytest.mark.parametrize("topic", ["/any", "/part", "/parts", "/poses"])
@pytest.mark.parametrize(
    ("z", "w", "is_allowed"),
    [(0.0, 1.0, True), (0.6, 0.8, True), (0.0, 0.0, False), (math.nan, 1.0, False), (0.0, 0.5, False),
     (1e308, 0.0, False), (math.inf, 0.0, False)],
)  # fmt: skip
def test_a_quaternion_that_nodes_refuse_is_refused_even_if_any_value_is_allowed(
    topic: str, z: float, w: float, is_allowed: bool
) -> None:
    policy = parse_policy(QUATERNION_POLICY, "p.yaml")
    pose: Any = load_message_class("geometry_msgs/Pose")()
    pose.orientation.z, pose.orientation.w = z, w
    kind = "geometry_msgs/PoseArray" if topic == "/poses" else "geometry_msgs/PoseStamped"
    message: Any = load_message_class(kind)()
    if topic == "/poses":
        message.poses = [pose]
    else:
        message.pose = pose
    act = Act(ActKind.TOPIC, topic, message, message._type, message._md5sum)
    if is_allowed:
        decide(policy, act, PolicyState(), 0.0)
    else:
        with pytest.raises(ActRefused):
            decide(policy, act, PolicyState(), 0.0)
