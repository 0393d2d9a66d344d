"""Statistics of the numbers in messages."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_tools.graph.value_statistics import FIELDS, numbers_in, summaries

Odometry: Any = load_message_class("nav_msgs/Odometry")
LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
Float64: Any = load_message_class("std_msgs/Float64")


def test_fields_are_named_with_dots_and_arrays_have_one_name() -> None:
    names = [name for name, _ in numbers_in(LaserScan(ranges=[1.0, 2.0]))]
    assert names.count("ranges[]") == 2
    assert "header.stamp" in names
    assert {"pose.covariance[]", "pose.pose.position.x"} <= {name for name, _ in numbers_in(Odometry())}


def test_statistics_leave_out_what_is_not_finite() -> None:
    [row] = summaries([Float64(each) for each in (1.0, math.nan, 3.0, math.inf)])
    assert row == {
        "field": "data", "values": 2, "not_finite": 2, "min": 1.0, "max": 3.0, "mean": 2.0, "deviation": 1.0,
        "first": 1.0, "last": 3.0,
    }  # fmt: skip
    assert summaries([math.nan]) == [{"field": "value", "values": 0, "not_finite": 1}]


def test_large_numbers_keep_their_deviation() -> None:
    [row] = summaries([1.7e9, 1.7e9 + 1.0])
    assert row["deviation"] == pytest.approx(0.5)
    assert row["mean"] == 1.7e9 + 0.5


def test_texts_have_no_statistics_and_fields_are_limited() -> None:
    assert (summaries(["a text", b"bytes"]), len(summaries([[[[each]] for each in range(3)]]))) == ([], 1)
    many = type("Many", (), {"__slots__": [f"f{n}" for n in range(FIELDS + 9)], "_slot_types": []})()
    for name in many.__slots__:
        setattr(many, name, 1.0)
    assert len(summaries([many])) == FIELDS
