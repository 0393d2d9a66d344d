"""The methods that every message class has."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest
from geometry_msgs.msg import Point, PoseStamped, Twist
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, String

from pipros.msg.base import Message
from pipros.msg.errors import SerializationError


def test_values_are_given_in_order_or_by_name() -> None:
    assert Point(1.0, 2.0, 3.0) == Point(z=3.0, y=2.0, x=1.0)
    assert (Point(x=1.0).y, Point().z) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("make", "kind", "words"),
    [
        (lambda: Point(1.0, y=2.0), TypeError, "may only use args OR keywords, not both"),
        (lambda: Point(1.0, 2.0), TypeError, "Invalid number of arguments, args should be"),
        (lambda: Point(w=1.0), AttributeError, "w is not an attribute of Point"),
        (lambda: setattr(Point(), "w", 1.0), AttributeError, "w"),
    ],
    ids=["both", "too few", "unknown", "set later"],
)
def test_values_that_do_not_fit_are_refused(make: Any, kind: type[Exception], words: str) -> None:
    with pytest.raises(kind, match=words):
        make()


def test_messages_are_equal_by_class_and_fields() -> None:
    assert Point(1.0, 2.0, 3.0) != Point(1.0, 2.0, 4.0)
    assert Point() != Twist()
    assert String("x") != "x"
    assert JointState(position=[1.0, 2.0]) == JointState(position=(1.0, 2.0))
    unfinished = Point()
    del unfinished.x
    assert unfinished != Point()


def test_messages_cannot_be_keys_because_they_change() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(Point())


def test_copies_and_pickles_are_independent_messages() -> None:
    message = PoseStamped()
    message.pose.position.x = 1.5
    for made in (copy.deepcopy(message), pickle.loads(pickle.dumps(message))):  # noqa: S301
        assert made == message
        assert made.pose is not message.pose
    shallow = copy.copy(message)
    assert (shallow, shallow.pose is message.pose) == (message, True)


def test_a_message_without_fields_takes_no_bytes() -> None:
    assert b"".join(Empty()._to_buffers()) == b""
    assert Empty._from_bytes(b"") == Empty()


def test_a_handwritten_class_has_the_methods_of_messages() -> None:
    class Nothing(Message):
        __slots__: list[str] = []  # as in genpy's classes
        _slot_types: list[str] = []  # noqa: RUF012

    message = Nothing()
    assert message.deserialize(b"anything") is message
    assert message.deserialize_numpy(b"anything", None) is message
    message.serialize_numpy(None, None)  # type: ignore[arg-type]
    assert Nothing._from_bytes(b"").__getstate__() == []
    with pytest.raises(SerializationError, match="a reason of its own"):
        message._check_types(ValueError("a reason of its own"))
