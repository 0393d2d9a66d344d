"""The bodies of `serialize` and `deserialize`: fields that share a call of `struct`, and errors."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy
import pytest

from pipros.msg.compile.decode import deserialize_body
from pipros.msg.compile.emitter import Names
from pipros.msg.compile.encode import serialize_body
from pipros.msg.compile.layout import TypeLayouts
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError, SerializationError
from pipros.msg.language.full_text import specs_from_text

SEPARATOR = "=" * 80


def made(text: str) -> Any:
    return message_classes_from_text("a/T", text)["a/T"]


def source(text: str, body: Any) -> str:
    specs = specs_from_text("a/T", text)
    return "\n".join(body(TypeLayouts(specs.__getitem__).of(specs["a/T"]), Names(), indent=0))


def serialized(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


PLAIN = "int32 a\nfloat64[3] b\ntime c\nbool d"


def test_scalars_times_and_short_arrays_are_one_call() -> None:
    assert source(PLAIN, serialize_body).count("pack_0(") == 1
    assert source(PLAIN, deserialize_body).count("unpack_from_0(") == 1


def test_an_array_of_equal_messages_is_unpacked_by_one_iterator() -> None:
    text = f"B[] bs\n{SEPARATOR}\nMSG: a/B\nfloat32 x\nfloat32 y"

    assert "iter_unpack" in source(text, deserialize_body)
    message = made(text)
    data = struct.pack("<I4f", 2, 1, 2, 3, 4)
    assert [(b.x, b.y) for b in message().deserialize(data).bs] == [(1, 2), (3, 4)]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        (PLAIN, {"a": 1, "b": [1.0, 2.0], "c": None, "d": True}),
        ("int8[2] a\nint8[2] b", {"a": [1], "b": [1, 2, 3]}),  # the lengths make up for each other
        ("string a\nint8 b", {"a": "x", "b": 300}),
        (f"B[2] bs\n{SEPARATOR}\nMSG: a/B\nstring s", {"bs": []}),
        ("string[] a", {"a": ["x", 1]}),
        ("uint8[3] a", {"a": [1, 2]}),
    ],
)
def test_a_message_that_cannot_be_serialised_writes_no_bytes(text: str, values: dict[str, Any]) -> None:
    message = made(text)(**{name: value for name, value in values.items() if value is not None})
    buffer = io.BytesIO(b"")

    with pytest.raises(SerializationError):
        message.serialize(buffer)
    assert buffer.getvalue() == b""


def test_a_large_array_reaches_the_transport_without_a_copy() -> None:
    message = made("string s\nfloat64[] data\nint8 end")(s="a", data=numpy.zeros(1000), end=1)

    pieces = message._to_buffers()

    assert [type(piece) for piece in pieces] == [bytes, memoryview, bytes]
    assert b"".join(pieces) == struct.pack("<I1sI", 1, b"a", 1000) + bytes(8000) + b"\x01"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        "string a\nstring b",
        "string[] a",
        "float64[] a\nint8 b",
        "uint8[] a",
        "time[] a",
        f"B[] bs\n{SEPARATOR}\nMSG: a/B\nstring s\nuint8[4] o",
        f"B[] bs\nint8 x\n{SEPARATOR}\nMSG: a/B\nfloat32[2] f\nduration d",
    ],
)
def test_every_message_that_is_cut_off_is_refused(text: str) -> None:
    cls = made(text)
    message = cls()
    for name, kind in zip(cls.__slots__, cls._slot_types, strict=True):
        if kind == "string":
            setattr(message, name, "hello")
        elif kind == "string[]":
            setattr(message, name, ["hello", "world"])
        elif kind == "float64[]":
            setattr(message, name, [1.0, 2.0])
        elif kind == "uint8[]":
            setattr(message, name, b"hello")
        elif kind == "time[]":
            message.a = [type(made("time t")().t)(1, 2)]
        elif kind == "a/B[]":
            message.bs = [message_classes_from_text("a/T", text)["a/B"]() for _ in range(2)]
    data = serialized(message)

    assert serialized(cls().deserialize(data)) == data
    for end in range(len(data)):
        with pytest.raises(DeserializationError):
            cls().deserialize(data[:end])


def test_a_claimed_length_takes_no_memory() -> None:
    for text in ("float64[] a", "string a", "string[] a", "time[] a", "uint8[] a"):
        with pytest.raises(DeserializationError):
            made(text)().deserialize(b"\xff\xff\xff\x7f")


def test_octets_can_be_read_from_a_view() -> None:
    cls = made("uint8[] data\nstring s")
    data = serialized(cls(data=b"abc", s="é"))

    found = cls().deserialize(memoryview(data))

    assert (found.data, found.s) == (b"abc", "é")
