"""Every included type, compared with genuine genpy (tests.golden.messages), and random types."""

# needs the plugins: robot

import json
import random
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import genpy
import genpy.message
from pipros.msg import load_message_class, load_service_class
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError
from tests.golden.messages.record import FILE, jobs, recorded
from tests.interop.programs.examine_messages import build, examine, random_value, random_values, written
from tests.interop.random_definitions import full_text
from tests.support.examples import examples

GOLDEN = json.loads(FILE.read_text())


PACKAGES = sorted({name.partition("/")[0] for name in GOLDEN})


@cache
def jobs_of() -> dict[str, list[dict[str, Any]]]:
    """Return the types that ship, by package."""
    found: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
    for job in jobs():
        found[job["type"].partition("/")[0]].append(job)
    return found


def test_every_type_that_ships_was_recorded() -> None:
    assert {job["type"] for found in jobs_of().values() for job in found} == set(GOLDEN)


@pytest.mark.parametrize("package", PACKAGES)
def test_included_types_equal_those_of_genpy_byte_for_byte(package: str) -> None:
    for job in jobs_of()[package]:
        class_of = finder(job.get("service"))
        values = random_values(job, class_of)
        answer = json.loads(json.dumps(examine({**job, "values": values}, class_of, genpy)))
        assert recorded(answer) == GOLDEN[job["type"]], job["type"]


def finder(service_type: str | None) -> Callable[[str], Any]:
    if service_type is None:
        return load_message_class
    service = load_service_class(service_type)
    halves = {half._type: half for half in (service._request_class, service._response_class)}
    return lambda kind: halves.get(kind) or load_message_class(kind)


# Random definitions and values: they survive a round trip, and truncation is detected.


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
