"""Messages filled from YAML values, with genpy's error texts."""

from __future__ import annotations

from typing import Any

import pytest
from geometry_msgs.msg import Point, Polygon, PoseStamped, Twist
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Duration as DurationMessage
from std_msgs.msg import Header, String
from std_msgs.msg import Time as TimeMessage

from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import MessageException
from pipros.msg.from_yaml import fill_message_args, get_printable_message_args
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.time import Duration, Time

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


@pytest.mark.parametrize(
    ("message", "args", "words"),
    [
        (Point(), [1, 2, 3, 4], "Too many arguments:\n * Given: [1, 2, 3, 4]\n * Expected: ['x', 'y', 'z']"),
        (Point(), [1], "Not enough arguments:\n * Given: [1]\n * Expected: ['x', 'y', 'z']"),
        (Point(), [{"w": 1}], "No field name [w]"),
        (Twist(), [{"linear": {"w": 1}}], "No field name [linear.w]"),
        (JointState(), [{"name": "a"}], "Field [name] must be a list or tuple instead of: str"),
        (
            *(Imu(), [{"orientation_covariance": [1.0]}]),
            "Field [orientation_covariance] has incorrect number of elements: 1 != 9",
        ),
    ],
)
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
        *("header.seq", "header.stamp", "header.frame_id", "pose.position.x"),
    ]
