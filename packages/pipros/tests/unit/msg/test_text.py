"""The text form of messages. test_golden.py compares that of every included type."""

from __future__ import annotations

import pytest
import yaml
from geometry_msgs.msg import Point, PoseStamped, Vector3
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, Float64MultiArray, Header, String, UInt8MultiArray

from pipros.msg.text import strify_message
from pipros.msg.time import Duration, Time


def test_members_are_indented_and_times_aligned() -> None:
    message = PoseStamped(header=Header(7, Time(1, 23), "map"))
    assert str(message).splitlines()[:8] == [
        "header: ",
        "  seq: 7",
        "  stamp: ",
        "    secs: 1",
        "    nsecs:        23",
        '  frame_id: "map"',
        "pose: ",
        "  position: ",
    ]


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
