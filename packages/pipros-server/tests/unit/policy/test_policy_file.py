"""Policies read from YAML: their rules, and errors that name the line, the key and what to write."""

import math
from pathlib import Path

import pytest

from pipros.safe.settings import BadSettings
from pipros_server.policy.field_check import check_value
from pipros_server.policy.field_file import BOUNDS
from pipros_server.policy.model import ActKind, ActRefused
from pipros_server.policy.policy_file import POLICY_FILE_BYTES, parse_policy, read_policy

POLICY = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields:
      linear.x: {range: [-0.3, 0.3], unit: m/s, change_per_s: 0.5}
      angular.z: {range: [-90, 90], unit: deg/s}
    per_minute: 600
    requires: dead_man
    stop: zero
services:
  /reset: {type: std_srvs/Empty, per_minute: 2}
actions:
  /move_base:
    type: move_base_msgs/MoveBaseAction
    fields:
      target_pose.header.frame_id: {one_of: [map]}
      target_pose.pose.position.x: {range: [0, 5], unit: m}
      target_pose.pose.orientation: any
parameters:
  /speed: {type: double, range: [0, 1], unit: m/s}
conditions:
  dead_man: {topic: /joy, type: sensor_msgs/Joy, field: "buttons[4]", one_of: [1], max_age_s: 0.5}
"""


def test_a_policy_has_the_rules_of_its_file() -> None:
    policy = parse_policy(POLICY, "/etc/robot/p.yaml")
    assert {(kind.value, name) for kind, name in policy.rules} == {
        ("topics", "/cmd_vel"), ("topics", "/move_base/goal"), ("topics", "/move_base/cancel"),
        ("services", "/reset"), ("parameters", "/speed"),
    }  # fmt: skip
    drive = policy.rules[ActKind.TOPIC, "/cmd_vel"]
    assert (drive.type, drive.per_minute, drive.requires) == ("geometry_msgs/Twist", 600, ("dead_man",))
    turn = drive.fields.below["angular"].below["z"].rule
    assert turn.most == pytest.approx(math.pi / 2)
    assert turn.place == "p.yaml:6: topics./cmd_vel.fields.angular.z"
    assert policy.conditions["dead_man"].path == ("buttons", 4)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("linear.x:", "linear.w:", "p.yaml:5: topics./cmd_vel.fields.linear.w: geometry_msgs/Vector3 has no"),
        ("linear.x: {range: [-0.3, 0.3]", "linear.x: {range: [0.3, -0.3]", "the smaller one first"),
        ("unit: m/s,", "unit: mph,", "must be one of m, m/s"),
        (
            "linear.x: {range: [-0.3, 0.3], unit: m/s, change_per_s: 0.5}",
            "linear: {count: 2}",
            "all elements",
        ),
        ("linear.x: {range: [-0.3, 0.3], unit: m/s, change_per_s: 0.5}", "linear.x: {}", "must have range"),
        ("linear.x: {range: [-0.3, 0.3],", "linear.x: {range: [-.inf, 0.3],", "must be a number or a list"),
        ("type: geometry_msgs/Twist", "type: geometry_msgs/Twits", "topics./cmd_vel.type: "),
        ("/cmd_vel:", "cmd_vel:", "topics.cmd_vel: must be a legal global name, such as /cmd_vel"),
        ("/cmd_vel:", "/cmd_v\u0435l:", "must be a legal global name"),  # with a Cyrillic letter
        ("/cmd_vel:", "//cmd_vel:", "must be a legal global name"),
        ("/cmd_vel:", "/cmd_vel/:", "must be written as /cmd_vel"),
        ("/reset:", "/reset: {type: std_srvs/Empty}\n  /reset:", "p.yaml:12: the key /reset occurs twice"),
        ("per_minute: 600", "per_minute: 0", "must be a number from 1 to 60000, got 0"),
        ("per_minute: 600", "per_minute: 1.5", "must be a whole number"),
        ("per_minute: 600", "per_minut: 600", "unknown key. Did you mean per_minute?"),
        ("requires: dead_man", "requires: deadman", "names deadman, which is not one of the conditions"),
        ("stop: zero", "stop: {linear: {w: 1}}", "p.yaml:9: topics./cmd_vel.stop: "),
        ("stop: zero", "time_limit_s: 0", "time_limit_s: must be a number from 0.1 to 3600, got 0"),
        ("{type: std_srvs/Empty, per", "{type: std_srvs/Empty, args: {}, per", "unknown key"),
        ("stop: zero", "stop: brake", "must be zero, or the values of a message, got 'brake'"),
        ("MoveBaseAction", "MoveBaseActionGoal", "must be the type of an action"),
        ("topic: /joy", "topic: /cmd_vel", "reads /cmd_vel, which clients may publish"),
        ("max_age_s: 0.5", "max_age_s: 0", "must be a finite number >= 0.01, got 0"),
        (", max_age_s: 0.5", "", "conditions.dead_man.max_age_s: is missing"),
        ('field: "buttons[4]"', "field: buttons", "must name one number, string or boolean"),
        ('field: "buttons[4]", ', "", "needs the key field"),
        ("one_of: [1], max", "one_of: [1], above: 2, max", "one_of: must not be combined with above"),
        ("type: double", "type: float", "must be one of bool, int, double, str, got 'float'"),
        ("services:", "topics:", "p.yaml:10: the key topics occurs twice"),
        ("fields:\n      target_pose.h", "fields: !!python/name:os.system\n      x", "p.yaml"),
        (POLICY, "conditions: {}", "must have at least one rule, such as one in the section topics"),
        (POLICY, "- 1", "must be a mapping, got list"),
    ],
)
def test_an_error_names_the_line_the_key_and_the_rule(before: str, after: str, message: str) -> None:
    assert before in POLICY
    with pytest.raises(BadSettings) as caught:
        parse_policy(POLICY.replace(before, after, 1), "p.yaml")
    assert message in str(caught.value)


def test_a_topic_of_an_action_cannot_have_a_second_rule() -> None:
    text = POLICY.replace(
        "services:", "  /move_base/goal: {type: move_base_msgs/MoveBaseActionGoal}\nservices:"
    )
    with pytest.raises(BadSettings, match="is a topic of an action in this policy"):
        parse_policy(text, "p.yaml")


def test_an_array_needs_brackets() -> None:
    text = "topics: {/j: {type: sensor_msgs/JointState, fields: {position: {range: [0, 1]}}}}"
    with pytest.raises(
        BadSettings, match=r"is an array; write position\[\] for all elements, or position\[0\]"
    ):
        parse_policy(text, "p.yaml")


def test_a_file_that_cannot_be_read_or_is_too_large_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadSettings, match=r"cannot read .*absent\.yaml: No such file"):
        read_policy(tmp_path / "absent.yaml")
    large = tmp_path / "large.yaml"
    most = POLICY_FILE_BYTES
    large.write_text("#" * (most + 1))
    with pytest.raises(BadSettings, match=f"it is larger than {most} bytes"):
        read_policy(large)


def test_a_time_limit_has_a_stop_of_zeros_by_default_and_cancels_the_goals_of_actions() -> None:
    limited = POLICY.replace("stop: zero", "time_limit_s: 0.5").replace(
        "MoveBaseAction\n", "MoveBaseAction\n    time_limit_s: 60\n"
    )
    policy = parse_policy(limited, "p.yaml")
    drive, goal = policy.rules[ActKind.TOPIC, "/cmd_vel"], policy.rules[ActKind.TOPIC, "/move_base/goal"]
    assert (drive.time_limit_s, drive.stop_topic, drive.stop) == (0.5, "/cmd_vel", drive.message_class())
    assert (goal.time_limit_s, goal.stop_topic, goal.stop) == (60, "/move_base/cancel", None)


def test_a_stop_must_fit_into_one_write() -> None:
    text = f"topics: {{/s: {{type: std_msgs/String, fields: any, stop: {{data: {'x' * 1024}}}}}}}"
    with pytest.raises(BadSettings, match="stop: must have at most 1024 bytes, got 1028"):
        parse_policy(text, "p.yaml")


@pytest.mark.parametrize(("text", "message"), [
    ("launch_files: {a/../b.launch: {time_limit_s: 1}}", "must be PACKAGE/FILE.launch"),
    ("launch_files: {/etc/b.launch: {time_limit_s: 1}}", "must be PACKAGE/FILE.launch"),
    ("launch_files: {a/.hidden.launch: {time_limit_s: 1}}", "must be PACKAGE/FILE.launch"),
    ("launch_files: {a/b.yaml: {time_limit_s: 1}}", "must be PACKAGE/FILE.launch"),
    ("launch_files: {a/b.launch: {}}", "time_limit_s: is missing"),
    ("launch_files: {a/b.launch: {time_limit_s: 1, args: {x: {}}}}", "must have range or one_of"),
    ("launch_files: {a/b.launch: {time_limit_s: 1, args: {x: any}}}", "args.x: must be a mapping"),
    ("recordings: {/a: {}}", "time_limit_s: is missing"),
    ("recordings: {a: {time_limit_s: 1}}", "must be a legal global name"),
    ("services: {/a: {type: std_srvs/Empty, time_limit_s: 1}}", "has no fields"),
    ("parameters: {/a: {type: int, time_limit_s: 1}}", "time_limit_s"),
])  # fmt: skip
def test_rules_for_programs_and_services_are_checked(text: str, message: str) -> None:
    with pytest.raises(BadSettings) as caught:
        parse_policy(text, "p.yaml")
    assert message in str(caught.value)


@pytest.mark.parametrize(("spec", "problem"), [
    ("linear.x: {one_of: [.inf]}", "must contain finite numbers"),
    ("linear.x: {one_of: [true]}", "must contain values of the type float64"),
    ("linear.x: {one_of: ['1']}", "must contain values of the type float64"),
    ("linear.x: {range: [0, 1" + 400 * "0" + "]}", "must be a number or a list of numbers"),
    ("linear.x: {range: [0, 1], start: 1}", "needs the key change_per_s"),
])  # fmt: skip
def test_a_bound_that_no_value_can_meet_or_that_every_value_meets_is_an_error(
    spec: str, problem: str
) -> None:
    text = f"topics:\n  /c:\n    type: geometry_msgs/Twist\n    fields: {{{spec}}}\n"
    with pytest.raises(BadSettings, match=problem):
        parse_policy(text, "p.yaml")


@pytest.mark.parametrize("stop", ["", "{linear: {x: .nan}}", "{linear: {x: .inf}}"])
def test_a_stop_that_does_not_stop_is_an_error(stop: str) -> None:
    text = f"topics:\n  /c:\n    type: geometry_msgs/Twist\n    fields: any\n    stop: {stop}\n"
    with pytest.raises(BadSettings, match="stop: must"):
        parse_policy(text, "p.yaml")


def test_an_index_beyond_the_end_of_an_array_is_an_error() -> None:
    text = "topics:\n  /o: {type: nav_msgs/Odometry, fields: {'pose.covariance[36]': any}}\n"
    with pytest.raises(BadSettings, match=r"the last one is covariance\[35\]"):
        parse_policy(text, "p.yaml")


@pytest.mark.parametrize("bound", sorted({*BOUNDS} - {"unit"}))
@pytest.mark.parametrize(
    "text",
    [
        "parameters:\n  /p: {type: TYPE, BOUND}\n",
        "launch_files:\n  a/b.launch:\n    time_limit_s: 1\n    args:\n      n: {BOUND}\n",
        "parameters:\n  /p: {type: bool}\n"
        "conditions:\n  c: {topic: /i, type: std_msgs/TYPE, field: data, BOUND, max_age_s: 1}\n",
    ],
)
def test_each_bound_works_wherever_values_are_bounded(text: str, bound: str) -> None:
    """A place that ignores a bound would allow what it is meant to refuse."""
    values, good, bad, kind = {"range": ("[0, 1]", 1, 2, "Float64"), "one_of": ("[a]", "a", "b", "String")}[
        bound
    ]
    kind = {"Float64": "double", "String": "str"}[kind] if "type: TYPE, BOUND" in text else kind
    policy = parse_policy(text.replace("BOUND", f"{bound}: {values}").replace("TYPE", kind), "p.yaml")
    ((_, act),) = policy.rules.items()
    rules = [each.rule for each in policy.conditions.values()]
    rules += [act.fields.rule, *(each.rule for each in act.fields.below.values())]
    rule = next(each for each in rules if each is not None)
    assert check_value(good, rule, "it") == good
    with pytest.raises(ActRefused):
        check_value(bad, rule, "it")


DRIVE = """
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-1, 1]}, angular.z: {range: [0.1, 1]}}
"""
PAUSE = """
services:
  /mode: {type: std_srvs/SetBool, fields: {data: {one_of: [true]}}, stop: {data: false}}
topics:
  /gripper: {type: std_msgs/Int8, fields: {data: {one_of: [1, 2]}}, stop: {data: 3}}
  /word: {type: std_msgs/String, fields: {data: {one_of: [go]}}, stop: {data: halt}}
  /joints: {type: std_msgs/Float64MultiArray, fields: {"data[]": {range: [1, 2]}}, stop: {data: [0, 0, 1.5]}}
  /pose: {type: geometry_msgs/Quaternion, fields: {z: {range: [-1, 1]}}, stop: zero}
"""
BEYOND = {
    "{linear: {x: 50}}": "linear.x of /cmd_vel must be from -1 to 1, got 50",
    "{linear: {x: -1.01}}": "linear.x of /cmd_vel must be from -1 to 1, got -1.01",
    "{linear: {y: 0.1}}": "linear.y of /cmd_vel has no rule and must be zero or empty, got 0.1",
    "{angular: {z: 0.05}}": "angular.z of /cmd_vel must be from 0.1 to 1, got 0.05",
}


@pytest.mark.parametrize(("stop", "reason"), BEYOND.items(), ids=str)
def test_a_stop_does_not_move_a_robot_faster_than_clients_may(stop: str, reason: str) -> None:
    action = """actions:
  /move_base:
    type: move_base_msgs/MoveBaseAction
    fields: any
    time_limit_s: 9
    stop: {topic: /cmd_vel, type: geometry_msgs/Twist, values: STOP}
"""
    for text, place in (
        (f"{DRIVE}    stop: {stop}\n", "p.yaml:6: topics./cmd_vel.stop: "),
        (DRIVE + action.replace("STOP", stop), "p.yaml:11: actions./move_base.stop: "),
    ):
        with pytest.raises(BadSettings) as error:
            parse_policy(text, "p.yaml")
        assert str(error.value).startswith(place)
        assert reason in str(error.value)


def test_a_stop_may_be_zero_a_slower_motion_or_another_mode() -> None:
    for stop in ("zero", "{linear: {x: 0.5}}", "{linear: {x: 0.0}}", "{angular: {z: 0.1}}"):
        assert parse_policy(f"{DRIVE}    stop: {stop}\n", "p.yaml").rules
    assert len(parse_policy(PAUSE, "p.yaml").rules) == 5
