"""Errors about fields that do not fit their types, with genpy's texts."""

from typing import Any

import numpy
import pytest

from pipros.msg import load_message_class
from pipros.msg.check import check_lengths, check_type, check_values
from pipros.msg.errors import SerializationError
from pipros.msg.field_access import field_of
from pipros.msg.time import Duration, Time

Point = load_message_class("geometry_msgs/Point")


Header = load_message_class("std_msgs/Header")


Imu = load_message_class("sensor_msgs/Imu")


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("int8", -128), ("uint8", 255), ("int64", 2**63 - 1), ("char", 0), ("byte", -1),
        ("float32", 1), ("float64", 1.5), ("bool", True), ("bool", 1), ("string", "a"), ("string", b"\xff"),
        ("time", Time(1)), ("duration", Duration(-1)), ("uint8[]", b"ab"), ("uint8[3]", "abc"),
        ("int32[]", [1, 2]), ("string[]", ("a",)), ("geometry_msgs/Point", Point()), ("Header", Header()),
        ("std_msgs/Header", Header()), ("geometry_msgs/Point[]", [Point()]),
    ],
)  # fmt: skip
def test_a_value_that_fits_is_accepted(kind: str, value: Any) -> None:
    check_type("f", kind, value)


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        ("int8", 128, "field f exceeds specified width [int8]"),
        ("uint8", -1, "field f must be unsigned integer type"),
        ("int32", 1.0, "field f must be an integer type"),
        ("int32", True, "field f must be an integer type"),
        ("float64", "1", "field f must be float type"),
        ("bool", 2, "field f is not a bool"),
        ("string", "é", "field f is a non-ascii string"),
        ("string", 1, "field f must be of type bytes or an ascii string"),
        ("time", 1.0, "field f must be of type Time"),
        ("duration", Time(), "field f must be of type Duration"),
        ("int32[]", b"ab", "field f must be a list or tuple type. Only uint8[] can be a string"),
        ("int32[]", 1, "field f must be a list or tuple type"),
        ("int32[]", [1, "x"], "field f[] must be an integer type"),
        ("geometry_msgs/Point", Header(), "field f must be a Header instead of a std_msgs/Header"),
        (
            "std_msgs/Header",
            Point(),
            "field f must be of type std_msgs/Header instead of geometry_msgs/Point",
        ),
        ("geometry_msgs/Point", 1, "field f must be of type [geometry_msgs/Point]"),
        ("geometry_msgs/Point", Point(x="1"), "field f.x must be float type"),
        ("geometry_msgs/Point[]", [Point(y=None), Point(y="2")], "field f[].y must be float type"),
    ],
)  # fmt: skip
def test_the_field_is_named_with_its_path(kind: str, value: Any, words: str) -> None:
    with pytest.raises(SerializationError) as raised:
        check_type("f", kind, value)
    assert str(raised.value) == words


def test_numbers_of_numpy_are_floats() -> None:
    check_type("f", "float64", numpy.float32(1.5))
    check_type("f", "float64", numpy.int16(1))
    with pytest.raises(SerializationError):
        check_type("f", "int32", numpy.int32(1))


def test_lengths_are_checked_in_embedded_messages_too() -> None:
    imu = Imu()
    check_lengths("self", imu)
    imu.orientation_covariance = [0.0] * 8  # type: ignore[attr-defined]

    with pytest.raises(SerializationError) as raised:
        check_lengths("self", imu)
    assert str(raised.value) == ("Expecting 9 items but found 8 when writing 'self.orientation_covariance'")


# The attributes of messages and times that expressions may read.


def test_fields_and_the_type_of_a_message_are_read() -> None:
    header = Header(seq=4, stamp=Time(3, 500_000_000), frame_id="map")

    assert (field_of(header, "frame_id"), field_of(header, "_type")) == ("map", "std_msgs/Header")
    assert field_of(field_of(header, "stamp"), "to_sec")() == 3.5


@pytest.mark.parametrize("name", ["__class__", "serialize", "secs", "_full_text"])
def test_only_the_named_fields_are_read(name: str) -> None:
    with pytest.raises(AttributeError, match=rf"Header has no field \[{name}\]"):
        field_of(Header(), name)


@pytest.mark.parametrize(("value", "name"), [(Time(3, 0), "canon"), ("text", "upper"), ([1], "append")])
def test_no_method_that_changes_a_value_is_read(value: object, name: str) -> None:
    with pytest.raises(AttributeError, match="has no field"):
        field_of(value, name)


def test_text_that_is_written_need_not_be_ascii() -> None:
    states = load_message_class("sensor_msgs/JointState")
    message = states(header=Header(frame_id="grün"), name=["低"])
    check_values(message)
    with pytest.raises(SerializationError, match="non-ascii"):
        message._check_types()
    message.name.append("\ud800")
    with pytest.raises(SerializationError, match=r"^field name\[\] is not UTF-8$"):
        check_values(message)
