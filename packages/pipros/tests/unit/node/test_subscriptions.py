"""Messages are encoded and decoded with the fastest methods of their class."""

import asyncio
import threading
from typing import Any, BinaryIO

import pytest
from std_msgs.msg import String

from pipros.basics.errors import NotFound
from pipros.msg import load_message_class
from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import class_named, decoder, encoder
from pipros.node.latch import LatchedFirst


class GenuineString:
    """A class as written by genuine generators: `serialize` to a file, `deserialize` from bytes."""

    def __init__(self, data: bytes = b"") -> None:
        self.data = data

    def serialize(self, buff: BinaryIO) -> None:
        buff.write(self.data)

    def deserialize(self, data: bytes) -> Any:
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


# Topics that are advertised and subscribed with the name of a type.


def test_a_type_is_a_class_or_its_name() -> None:
    assert class_named(String) is String
    assert class_named("std_msgs/String") is String
    with pytest.raises(NotFound, match="Nothing"):
        class_named("std_msgs/Nothing")


# A callback added to a latched topic receives the last message first, and every later one.


def test_latched_messages_are_delivered_first() -> None:
    got: list[int] = []
    first = LatchedFirst([1, 2], got.append)
    first(3)
    first.give()
    first(4)
    assert got == [1, 2, 3, 4]


def test_a_message_that_arrives_during_the_latched_one_waits_for_it() -> None:
    got: list[int] = []
    is_within, may_go_on = threading.Event(), threading.Event()

    def call_back(message: int) -> None:
        is_within.set()
        assert may_go_on.wait(30)
        got.append(message)

    first = LatchedFirst([1], call_back)
    giver = threading.Thread(target=first.give)
    giver.start()
    assert is_within.wait(30)
    first(2)
    assert got == []
    may_go_on.set()
    giver.join()
    assert got == [1, 2]


def test_a_callback_may_trigger_the_next_message() -> None:
    got: list[int] = []

    def call_back(message: int) -> None:
        got.append(message)
        if message < 3:
            first(message + 1)

    first = LatchedFirst([1], call_back)
    first.give()
    assert got == [1, 2, 3]


# Message streams deliver messages from other threads, the newest ones if the queue is full.


def fill(stream: MessageStream[int], count: int) -> None:
    """Add numbers from another thread, then end the stream."""
    thread = threading.Thread(target=lambda: ([stream(number) for number in range(count)], stream.close()))
    thread.start()
    thread.join()


def test_without_a_queue_size_all_messages_are_kept_in_order() -> None:
    async def take() -> list[int]:
        stream: MessageStream[int] = MessageStream(None)
        fill(stream, 100)
        return [number async for number in stream]

    assert asyncio.run(take()) == list(range(100))


def test_with_a_queue_size_the_newest_are_kept_and_the_others_counted() -> None:
    async def take() -> tuple[list[int], int]:
        stream: MessageStream[int] = MessageStream(2)
        fill(stream, 100)
        return [number async for number in stream], stream.dropped

    assert asyncio.run(take()) == ([98, 99], 98)


def test_a_message_after_the_end_of_the_loop_is_dropped() -> None:
    async def make() -> MessageStream[int]:
        stream: MessageStream[int] = MessageStream(None)
        fill(stream, 2)
        return stream

    async def take() -> list[int]:
        return [number async for number in stream]

    stream = asyncio.run(make())
    stream(2)
    stream.close()
    assert asyncio.run(take()) == [0, 1]
    assert stream.dropped == 0
