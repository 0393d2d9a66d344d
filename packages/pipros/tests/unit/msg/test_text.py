"""The text forms of messages, such as YAML."""

from typing import Any

import pytest
import yaml
from geometry_msgs.msg import Point, Polygon, PoseStamped, Twist, Vector3
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import ColorRGBA, Float64MultiArray, Header, String, UInt8MultiArray
from std_msgs.msg import Duration as DurationMessage
from std_msgs.msg import Time as TimeMessage

from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import MessageException
from pipros.msg.from_yaml import fill_message_args, get_printable_message_args
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.text import strify_message
from pipros.msg.time import Duration, Time


def test_members_are_indented_and_times_aligned() -> None:
    message = PoseStamped(header=Header(7, Time(1, 23), "map"))
    assert str(message).splitlines()[:8] == [
        "header: ", "  seq: 7", "  stamp: ", "    secs: 1", "    nsecs:        23", '  frame_id: "map"',
        "pose: ", "  position: ",
    ]  # fmt: skip


def test_it_is_yaml() -> None:
    message = JointState(name=["a", "it's"], position=[1.5], header=Header(frame_id='say "hi"'))
    parsed = yaml.safe_load(str(message))
    assert (parsed["name"], parsed["position"], parsed["effort"]) == (["a", "it's"], [1.5], [])
    assert parsed["header"]["frame_id"] == 'say "hi"'


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=200))
def test_every_string_is_quoted_as_yaml_quotes_it(text: str) -> None:
    expected = yaml.dump(text, default_style='"').rstrip("\n") if text else "''"
    assert strify_message(text) == expected


def test_octets_are_shown_as_numbers() -> None:
    assert str(UInt8MultiArray(data=b"\1\xff")).endswith("data: [1, 255]")


def test_only_the_fields_that_the_filter_names_are_shown() -> None:
    assert strify_message(Point(1, 2, 3), field_filter=lambda message: ["x", "z"]) == "x: 1\nz: 3"


def test_times_can_be_shown_from_an_offset_on() -> None:
    shown = strify_message(Header(stamp=Time(5, 1)), time_offset=Time(3))
    assert "secs: 2\n  nsecs:         1" in shown
    assert strify_message(Duration(5), time_offset=Time(3)) == "\nsecs: 5\nnsecs:         0"


@pytest.mark.parametrize(
    ("value", "shown"), [(3, "     3"), (3.14159265, "3.1415"), (True, "True"), (-2.5, "-2.500")]
)
def test_numbers_can_be_given_a_width(value: float, shown: str) -> None:
    assert strify_message(value, fixed_numeric_width=6) == shown


def test_a_width_applies_within_arrays_and_times() -> None:
    assert strify_message(Vector3(1.0, 2.0, 3.0), fixed_numeric_width=4) == "x: 1.00\ny: 2.00\nz: 3.00"
    assert strify_message([1.0, 2.0], fixed_numeric_width=3) == "[1.0, 2.0]"
    assert strify_message(Time(1, 2), fixed_numeric_width=5) == "\nsecs:     1\nnsecs:     2"


def test_arrays_of_messages_are_lists_of_blocks() -> None:
    assert strify_message([Point(1, 2, 3)]) == "\n- \n  x: 1\n  y: 2\n  z: 3"
    assert strify_message([ColorRGBA()], indent="  ").startswith("\n  - \n    r: 0.0")


def test_an_empty_message_and_empty_arrays() -> None:
    assert strify_message(String()) == "data: ''"
    assert strify_message(Float64MultiArray()).endswith("data: []")


NOW = Time(5, 6)


KEYS = {"now": NOW, "auto": Header(stamp=NOW)}


def filled(message: Message, args: Any) -> Any:
    fill_message_args(message, args, KEYS)
    return message


def test_values_in_order() -> None:
    assert filled(Point(), [1, 2, 3]) == Point(1, 2, 3)
    assert filled(Twist(), [[1, 2, 3], [4, 5, 6]]).angular.z == 6


def test_a_dictionary_sets_some_fields() -> None:
    twist = filled(Twist(), [{"linear": {"x": 2}}])
    assert (twist.linear.x, twist.linear.y) == (2, 0.0)


def test_no_values_are_valid_only_for_a_message_without_fields() -> None:
    with pytest.raises(MessageException, match="Not enough arguments"):
        filled(String(), None)


def test_now_and_auto_are_times_and_headers() -> None:
    assert filled(TimeMessage(), ["now"]).data is NOW
    assert filled(PoseStamped(), [{"header": "auto"}]).header.stamp == NOW
    with pytest.raises(MessageException, match=r"No key named \[later\]"):
        filled(TimeMessage(), ["later"])


def test_times_are_nanoseconds_or_their_two_parts() -> None:
    assert filled(TimeMessage(), [1_500_000_000]).data == Time(1, 500_000_000)
    assert filled(TimeMessage(), [{"data": {"secs": 1, "nsecs": 2}}]).data == Time(1, 2)
    assert filled(DurationMessage(), [[3, 4]]).data == Duration(3, 4)


def test_arrays_of_messages_are_made_of_lists_and_dictionaries() -> None:
    polygon = filled(Polygon(), [{"points": [[1, 2, 3], {"y": 5}]}])
    assert [(point.x, point.y) for point in polygon.points] == [(1, 2), (0.0, 5)]


def test_a_yaml_key_without_a_value_is_an_empty_string() -> None:
    assert filled(String("x"), [{"data": None}]).data == ""


@pytest.mark.parametrize(("message", "args", "words"), [
    (Point(), [1, 2, 3, 4], "Too many arguments:\n * Given: [1, 2, 3, 4]\n * Expected: ['x', 'y', 'z']"),
    (Point(), [1], "Not enough arguments:\n * Given: [1]\n * Expected: ['x', 'y', 'z']"),
    (Point(), [{"w": 1}], "No field name [w]"), (Twist(), [{"linear": {"w": 1}}], "No field name [linear.w]"),
    (JointState(), [{"name": "a"}], "Field [name] must be a list or tuple instead of: str"),
    (*(Imu(), [{"orientation_covariance": [1.0]}]),
        "Field [orientation_covariance] has incorrect number of elements: 1 != 9"),
])  # fmt: skip
def test_errors_name_the_wrong_part_of_a_definition(message: Message, args: Any, words: str) -> None:
    with pytest.raises(MessageException) as caught:
        filled(message, args)
    assert str(caught.value) == words


def test_arrays_of_numbers_texts_and_times_are_set() -> None:
    assert filled(JointState(), [{"name": ["a", "b"], "position": (1.5,)}]).name == ["a", "b"]
    times = message_classes_from_text("robot/Log", "time[] times\nduration[] spans")["robot/Log"]
    log = filled(times(), [{"times": [1_500_000_000, [2, 3], {"secs": 4}], "spans": [-1_000_000_000]}])
    assert log.times == [Time(1, 500_000_000), Time(2, 3), Time(4, 0)]
    assert log.spans == [Duration(-1, 0)]


def test_an_array_of_a_type_that_is_not_installed_is_an_error() -> None:
    text = f"no_robot/Arm[] arms\n{SEPARATOR}\nMSG: no_robot/Arm\nint32 x"
    made = message_classes_from_text("robot/Body", text)["robot/Body"]
    assert filled(made(), [{"arms": []}]).arms == []
    expected = r"Cannot instantiate messages for field \[arms\] : cannot load class no_robot/Arm"
    with pytest.raises(MessageException, match=expected):
        filled(made(), [{"arms": [[1]]}])


def test_only_messages_are_filled() -> None:
    wrong: Any = 3
    with pytest.raises(ValueError, match="msg must be a Message instance: 3"):
        filled(wrong, [])


def test_a_value_that_is_neither_list_nor_dictionary_is_a_value_error() -> None:
    with pytest.raises(ValueError, match=r"invalid msg_args type: 1\.5"):
        filled(TimeMessage(), [1.5])


def test_the_names_of_all_values_can_be_listed() -> None:
    assert get_printable_message_args(PoseStamped()).split()[:4] == [
        *("header.seq", "header.stamp", "header.frame_id", "pose.position.x")
    ]
