"""The attributes of messages and times that expressions may read."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.msg.field_access import field_of
from pipros.msg.time import Time

Header: Any = load_message_class("std_msgs/Header")


def test_fields_and_the_type_of_a_message_are_read() -> None:
    header = Header(seq=4, stamp=Time(3, 500_000_000), frame_id="map")

    assert field_of(header, "frame_id") == "map"
    assert field_of(header, "_type") == "std_msgs/Header"
    assert field_of(field_of(header, "stamp"), "to_sec")() == 3.5


@pytest.mark.parametrize("name", ["__class__", "serialize", "secs", "_full_text"])
def test_only_the_named_fields_are_read(name: str) -> None:
    with pytest.raises(AttributeError, match=rf"Header has no field \[{name}\]"):
        field_of(Header(), name)


@pytest.mark.parametrize(("value", "name"), [(Time(3, 0), "canon"), ("text", "upper"), ([1], "append")])
def test_no_method_that_changes_a_value_is_read(value: object, name: str) -> None:
    with pytest.raises(AttributeError, match="has no field"):
        field_of(value, name)
