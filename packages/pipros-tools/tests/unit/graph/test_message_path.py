import json
import math
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import PoseArray
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Float64, Header, String

from genpy import Time
from pipros.basics.errors import NotFound
from pipros.msg import load_message_class
from pipros.msg.dynamic import message_classes_from_text
from pipros_tools.graph.message_path import (
    InvalidIndex,
    NotAnArray,
    PathStep,
    describe_path,
    extract,
    has_field,
    parse_path,
)
from pipros_tools.graph.message_tree import LEAVES, message_tree

LaserScan = load_message_class("sensor_msgs/LaserScan")
DiagnosticArray = load_message_class("diagnostic_msgs/DiagnosticArray")
DiagnosticStatus = load_message_class("diagnostic_msgs/DiagnosticStatus")


@pytest.mark.parametrize(("text", "steps"), [
    ("", []), ("/header/stamp", [PathStep("header", "header"), PathStep("stamp", "stamp")]),
    ("/ranges[2]", [PathStep("ranges[2]", "ranges", 2)]),
    ("/ranges[-1]", [PathStep("ranges[-1]", "ranges", -1)]),
    ("/ranges[1:]", [PathStep("ranges[1:]", "ranges", slice(1, None))]),
    ("/ranges[::2]", [PathStep("ranges[::2]", "ranges", slice(None, None, 2))]),
])  # fmt: skip
def test_a_path_is_fields_with_indices_and_slices(text: str, steps: list[PathStep]) -> None:
    assert parse_path(text) == steps


@pytest.mark.parametrize(
    "text", ["/ranges[x]", "/ranges[]", "/ranges[1:2:3:4]", "/ranges[1", "/ranges]1[", "/a[1][2]"]
)
def test_malformed_brackets_are_named(text: str) -> None:
    with pytest.raises(InvalidIndex, match=r"ranges|a\[1\]"):
        parse_path(text)


@pytest.mark.parametrize("text", ["", "/header", "/header/stamp/secs", "/ranges[1:3]", "/ranges[0]"])
def test_a_path_is_formatted_as_it_was_parsed(text: str) -> None:
    assert describe_path(parse_path(text)) == text


@pytest.mark.parametrize(("path", "value", "type_name"), [
    ("/ranges", (1.0, 2.0, 3.0), "float32[]"), ("/ranges[1]", 2.0, "float32"),
    ("/ranges[1:]", (2.0, 3.0), "float32[]"), ("/header/frame_id", "laser", "string"),
    ("/header/stamp/secs", 7, "int32"),
])  # fmt: skip
def test_a_part_comes_with_its_type(path: str, value: object, type_name: str) -> None:
    message = LaserScan(ranges=(1.0, 2.0, 3.0))
    message.header.frame_id = "laser"
    message.header.stamp.secs = 7
    part = extract(message, parse_path(path))
    assert (part.value, part.type_name) == (value, type_name)


def test_a_field_after_a_slice_is_read_from_each_element() -> None:
    message = DiagnosticArray(status=[DiagnosticStatus(name="a"), DiagnosticStatus(name="b")])
    part = extract(message, parse_path("/status[:]/name"))
    assert (part.value, part.type_name) == (["a", "b"], "string[]")
    assert extract(message, parse_path("/status[1]/name")).value == "b"


@pytest.mark.parametrize(
    "path", ["/nothing", "/header/nothing", "/ranges/length", "/header/stamp/to_sec", "/_type"]
)
def test_only_declared_fields_are_found(path: str) -> None:
    with pytest.raises(NotFound, match="no field named"):
        extract(LaserScan(), parse_path(path))


@pytest.mark.parametrize("path", ["/header[0]", "/range_max[0]", "/header[:]/stamp", "/header/stamp[0]"])
def test_only_arrays_have_elements(path: str) -> None:
    assert not has_field(LaserScan, parse_path(path))
    with pytest.raises(NotAnArray, match="is not an array"):
        extract(LaserScan(), parse_path(path))


def test_an_index_beyond_the_array_is_an_index_error() -> None:
    with pytest.raises(IndexError):
        extract(LaserScan(), parse_path("/ranges[0]"))


@pytest.mark.parametrize(("path", "exists"), [
    ("/header/stamp/nsecs", True), ("/ranges[100]", True), ("", True), ("/header/nope", False),
    ("/ranges/x", False),
])  # fmt: skip
def test_a_class_resolves_paths_to_fields(path: str, exists: bool) -> None:
    assert has_field(LaserScan, parse_path(path)) is exists


def test_a_class_resolves_paths_through_arrays() -> None:
    assert has_field(DiagnosticArray, parse_path("/status[0]/values[:]/key"))
    assert not has_field(DiagnosticArray, parse_path("/status/name"))


# Messages as values for JSON.


def test_fields_by_name() -> None:
    tree = message_tree(JointState(Header(1, Time(5, 6), "base"), ["a"], [1.5], [], [float("nan")]))
    assert tree == {
        "header": {"seq": 1, "stamp": {"secs": 5, "nsecs": 6}, "frame_id": "base"}, "name": ["a"],
        "position": [1.5], "velocity": [], "effort": ["nan"],
    }  # fmt: skip


def test_large_arrays_and_texts_are_shortened() -> None:
    tree = message_tree(Image(data=b"\1\2" * 500_000))
    assert tree["data"]["…"] == 1_000_000
    assert tree["data"]["hex"].startswith("01 02 01")
    assert message_tree(JointState(position=[0.5] * 1000))["position"] == {"…": 1000, "items": [0.5] * 40}
    assert len(message_tree(String("x" * 100_000))["data"]) < 5000


def test_a_message_of_many_parts_stays_small() -> None:
    from geometry_msgs.msg import Pose

    nested = {str(key): PoseArray(poses=[Pose()] * 40) for key in range(1000)}
    assert len(json.dumps(message_tree(nested))) < LEAVES * 60


def test_a_message_of_long_texts_stays_small() -> None:
    texts = {f"{key}" + "k" * 10_000: ["x" * 4000] * 40 for key in range(1000)}
    assert len(json.dumps(message_tree(texts))) < LEAVES * 60
    assert message_tree(["x" * 4000] * 40 + [""])["…"] == 41


def test_fields_that_are_named_like_those_of_a_time_are_not_one() -> None:
    message = message_classes_from_text("a/T", "float64 secs\nfloat64 nsecs\n")["a/T"](math.inf, math.nan)
    assert message_tree(message) == {"secs": "inf", "nsecs": "nan"}


@pytest.mark.parametrize(("value", "shown"), [
    (Float64(float("inf")), '{"data": "inf"}'), ({"a": float("-inf")}, '{"a": "-inf"}'),
    ([float("nan")], '["nan"]'),
])  # fmt: skip
def test_infinity_and_nan_are_texts_in_json(value: Any, shown: str) -> None:
    assert json.dumps(message_tree(value), allow_nan=False) == shown


@pytest.mark.parametrize(("value", "shown"), [
    (math.nan, {"#": "nan"}),
    (-math.inf, {"#": "-inf"}),
    ("nan", "nan"),
    (2**64 - 1, {"#": "18446744073709551615"}),
    ([-(2**53) - 1, 2**53], [{"#": "-9007199254740993"}, 2**53]),
    (numpy.array([2**63 - 1], numpy.int64), [{"#": "9223372036854775807"}]),
    ([True, None, 0.5], [True, None, 0.5]),
])  # fmt: skip
def test_numbers_that_javascript_cannot_read_are_marked_for_browsers(value: Any, shown: Any) -> None:
    assert message_tree(value, for_browser=True) == shown
