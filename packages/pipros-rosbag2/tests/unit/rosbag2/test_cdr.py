"""Messages as plain values, compared with the library rosbags."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.cdr import CdrError, decode, encode
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.parse import parse_ros2_message

CATALOG = Catalog(Distribution.JAZZY, installed_definitions())
ALL = parse_ros2_message(
    "bool b true\nbyte y\nchar c\nint8 i -3\nuint64 u\nfloat32 f\nfloat64 d 0.5\nstring<=3 s\nwstring w\n"
    "int16[3] a\nint32[<=2] n\nstring[] t\nbuiltin_interfaces/Time stamp\nstd_msgs/Header[] h\n",
    "own/msg/All",
)
VALUES: dict[str, Any] = {
    "b": False,
    "y": 200,
    "c": 7,
    "i": -128,
    "u": 2**64 - 1,
    "f": 0.25,
    "d": math.inf,
    "s": "äb",
    "w": "wé",
    "a": [1, -2, 3],
    "n": [4],
    "t": ["", "x"],
    "stamp": {"sec": -1, "nanosec": 5},
    "h": [{"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}],
}


def test_all_kinds_of_fields_survive() -> None:
    assert decode(encode(VALUES, ALL, CATALOG.message), ALL, CATALOG.message) == VALUES


def test_missing_fields_have_their_defaults() -> None:
    values = decode(encode({}, ALL, CATALOG.message), ALL, CATALOG.message)

    assert (values["b"], values["i"], values["d"], values["a"], values["n"]) == (True, -3, 0.5, [0, 0, 0], [])
    assert values["stamp"] == {"sec": 0, "nanosec": 0}


def test_the_bytes_are_those_of_rosbags() -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    message = CATALOG.message("sensor_msgs/msg/JointState")
    values = {
        "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"},
        "name": ["a", "bcd"],
        "position": [1.5, 2.5],
        "velocity": [],
        "effort": [-1.0],
    }
    payload = encode(values, message, CATALOG.message)

    theirs = store.deserialize_cdr(payload, message.type)
    assert bytes(store.serialize_cdr(theirs, message.type)) == payload


def test_an_empty_message_has_no_fields() -> None:
    empty = CATALOG.message("std_msgs/msg/Empty")

    assert decode(encode({}, empty, CATALOG.message), empty, CATALOG.message) == {}
    assert len(encode({}, empty, CATALOG.message)) == 5


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"z": 1}, r"own/msg/All has no field \[z\]; its fields: b, y"),
        ({"b": 1}, "b must be of the type bool, got 1"),
        ({"i": True}, "i must be of the type int8, got True"),
        ({"i": 200}, "i must be from -128 to 127, got 200"),
        ({"s": "abcd"}, "s must have at most 3 characters, got 4"),
        ({"s": 1}, "s must be a text, got 1"),
        ({"a": [1]}, "a must have 3 elements, got 1"),
        ({"n": [1, 2, 3]}, "n must have at most 2 elements, got 3"),
        ({"t": "x"}, "t must be a list, got 'x'"),
        ({"stamp": {"secs": 1}}, r"has no field \[secs\]"),
        ({"h": [{"stamp": 1}]}, "h.stamp must be a mapping of fields, got 1"),
    ],
)
def test_values_of_the_wrong_type_are_named(values: dict[str, Any], error: str) -> None:
    with pytest.raises(CdrError, match=error):
        encode(values, ALL, CATALOG.message)


def test_each_truncated_message_is_refused() -> None:
    payload = encode(VALUES, ALL, CATALOG.message)

    for size in range(len(payload)):
        with pytest.raises(PiprosError):
            decode(payload[:size], ALL, CATALOG.message)


def test_a_huge_sequence_of_a_short_message_is_refused() -> None:
    message = parse_ros2_message("std_msgs/Empty[] e", "own/msg/Many")

    with pytest.raises(CdrError, match="does not fit"):
        decode(b"\0\1\0\0" + b"\xff" * 4, message, CATALOG.message)
