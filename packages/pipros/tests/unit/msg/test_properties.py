"""Random definitions and values: they survive a round trip, and truncation is detected."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import genpy
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError
from tests.interop.programs.examine_messages import build, random_value, written
from tests.interop.random_definitions import full_text
from tests.support.examples import examples

seeds = st.integers(0, 2**32)


def made(seed: int) -> Message:
    """Return a message of a random type with random values."""
    classes: dict[str, Any] = dict(message_classes_from_text("made/T", full_text(seed)))
    value = random_value(random.Random(seed), "made/T", classes.__getitem__)  # noqa: S311
    message: Message = build("made/T", value, classes.__getitem__, genpy)
    return message


@settings(deadline=None, max_examples=examples(60))
@given(seeds)
def test_messages_survive_a_round_trip(seed: int) -> None:
    message = made(seed)
    data = written(message)
    read = type(message)._from_bytes(data)
    assert written(read) == data
    assert b"".join(read._to_buffers()) == data
    assert type(message)._from_bytes(memoryview(data)) == read or "nan" in str(read)


@settings(deadline=None, max_examples=examples(60))
@given(seeds, st.data())
def test_truncated_messages_raise(seed: int, data: st.DataObject) -> None:
    message = made(seed)
    whole = written(message)
    length = data.draw(st.integers(0, max(len(whole) - 1, 0)))
    try:
        read = type(message)._from_bytes(whole[:length])
    except DeserializationError:
        return
    assert written(read) == whole[:length] == whole, "only a message without bytes can be read from none"


@settings(deadline=None, max_examples=examples(60))
@given(seeds)
def test_failing_to_write_names_the_field_and_leaves_no_trace(seed: int) -> None:
    message = made(seed)
    last = getattr(message, message.__slots__[-1]) if message.__slots__ else None
    if last is None or last == [] or (isinstance(last, Message) and not written(last)):
        return  # none of it is written
    setattr(message, message.__slots__[-1], object())
    buffers: list[bytes] = []
    with pytest.raises(genpy.SerializationError, match=f"field {message.__slots__[-1]} |non-ascii"):
        message.serialize(type("Sink", (), {"write": lambda self, data: buffers.append(data)})())
    assert buffers == []
