"""Messages are encoded and decoded with the fastest methods of their class."""

from __future__ import annotations

from typing import Any, BinaryIO

import pytest

from pipros.msg import load_message_class
from pipros.node.codec import decoder, encoder


class GenuineString:
    """A class as written by genuine generators: `serialize` to a file, `deserialize` from bytes."""

    def __init__(self, data: bytes = b"") -> None:
        self.data = data

    def serialize(self, buff: BinaryIO) -> None:
        buff.write(self.data)

    def deserialize(self, data: bytes) -> GenuineString:
        if not isinstance(data, bytes):
            raise TypeError("generated code indexes and slices bytes")
        self.data = data
        return self


GENUINE: Any = GenuineString


@pytest.mark.parametrize("frame_type", [bytes, memoryview])
def test_a_message_survives_a_round_trip(frame_type: Any) -> None:
    string: Any = load_message_class("std_msgs/String")
    wire = b"".join(encoder(string)(string(data="hello")))
    assert wire == b"\x05\x00\x00\x00hello"
    assert decoder(string)(frame_type(wire)).data == "hello"


@pytest.mark.parametrize("frame_type", [bytes, memoryview])
def test_a_message_of_a_genuine_class_survives_a_round_trip(frame_type: Any) -> None:
    assert encoder(GENUINE)(GENUINE(b"hi")) == [b"hi"]
    assert decoder(GENUINE)(frame_type(b"hi")).data == b"hi"


def test_each_frame_makes_a_new_message() -> None:
    decode = decoder(GENUINE)
    first, second = decode(b"a"), decode(b"b")
    assert (first.data, second.data) == (b"a", b"b")
