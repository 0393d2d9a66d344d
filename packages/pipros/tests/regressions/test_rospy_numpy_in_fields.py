"""ROS Answers: numpy values in fields failed when they were published, or were written wrongly."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import Point, PoseWithCovariance
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Float64, Float64MultiArray, Int32, Int32MultiArray, String

import genpy

np: Any = numpy  # the stubs of messages name the types of Python alone


def sent(message: Any) -> Any:
    content = io.BytesIO()
    message.serialize(content)
    return type(message)().deserialize(content.getvalue())


GOOD: dict[str, tuple[Callable[[], Any], Callable[[Any], Any], Any]] = {
    "float32 as float64": (lambda: Float64(np.float32(1.5)), lambda m: m.data, 1.5),
    "int64 as int32": (lambda: Int32(np.int64(7)), lambda m: m.data, 7),
    "str": (lambda: String(np.str_("x")), lambda m: m.data, "x"),
    "items": (lambda: Point(*np.array([1, 2, 3])), lambda m: (m.x, m.y, m.z), (1.0, 2.0, 3.0)),
    "integers as floats": (
        lambda: Float64MultiArray(data=np.array([1, 2])), lambda m: list(m.data), [1.0, 2.0]),
    "int64 array": (lambda: Int32MultiArray(data=np.array([1, 2])), lambda m: list(m.data), [1, 2]),
    "float64 array": (lambda: LaserScan(ranges=np.array([1.0, 2.5])), lambda m: list(m.ranges), [1.0, 2.5]),
    "covariance": (
        lambda: PoseWithCovariance(covariance=np.arange(36)), lambda m: m.covariance[34:], (34.0, 35.0)),
    "texts": (lambda: JointState(name=np.array(["a", "b"])), lambda m: m.name, ["a", "b"]),
    "pixels": (  # Noetic refuses them
        lambda: Image(data=np.arange(9, dtype=np.uint8).reshape(1, 3, 3)), lambda m: m.data, bytes(range(9))),
}  # fmt: skip


@pytest.mark.parametrize("case", GOOD)
def test_numpy_values_that_fit_are_sent(case: str) -> None:
    make, value_of, expected = GOOD[case]
    assert value_of(sent(make())) == expected


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Int32(np.float64(7.0)), "data"),
        (lambda: Int32MultiArray(data=np.array([1.0, 2.0])), "data"),
        (lambda: Image(data=np.array([1, 2, 3])), "data"),  # 8 bytes each
        (lambda: PoseWithCovariance(covariance=np.zeros((6, 6))), "covariance"),
        (lambda: PoseWithCovariance(covariance=np.zeros(35)), "covariance"),
    ],
)
def test_numpy_values_that_do_not_fit_are_errors_that_name_the_field(
    make: Callable[[], Any], name: str
) -> None:
    with pytest.raises(genpy.SerializationError, match=f"field {name} must be"):
        sent(make())
