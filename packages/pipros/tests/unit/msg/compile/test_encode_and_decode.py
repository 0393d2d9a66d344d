"""The bodies of `serialize` and `deserialize`: fields that share a call of `struct`, and errors."""

from __future__ import annotations

import io
import struct
from typing import Any

import pytest

from pipros.msg.compile.decode import deserialize_body
from pipros.msg.compile.emitter import Names
from pipros.msg.compile.encode import serialize_body
from pipros.msg.compile.layout import TypeLayouts
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import SerializationError
from pipros.msg.language.full_text import specs_from_text

SEPARATOR = "=" * 80


def made(text: str) -> Any:
    return message_classes_from_text("a/T", text)["a/T"]


def source(text: str, body: Any) -> str:
    specs = specs_from_text("a/T", text)
    return "\n".join(body(TypeLayouts(specs.__getitem__).of(specs["a/T"]), Names(), indent=0))


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
