"""Messages as values for JSON."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import PoseArray
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Float64, Header, String

from genpy import Time
from pipros.msg.dynamic import message_classes_from_text
from pipros_tools.graph.message_tree import LEAVES, message_tree


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
