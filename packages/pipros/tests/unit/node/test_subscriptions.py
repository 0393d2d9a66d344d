"""Messages are encoded and decoded with the fastest methods of their class."""

import asyncio
import threading
from types import SimpleNamespace
from typing import Any, BinaryIO

import pytest
from std_msgs.msg import String

from pipros.basics.errors import NotFound
from pipros.msg import load_message_class
from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import class_named, decoder, encoder
from pipros.node.latch import LatchedFirst
from pipros.node.statistics_publisher import StatisticsPublisher
from pipros.node.topic_statistics import StatisticsWindow, TrafficMeter, WindowLimits


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


def test_a_type_is_a_class_or_its_name() -> None:
    assert class_named(String) is String
    assert class_named("std_msgs/String") is String
    with pytest.raises(NotFound, match="Nothing"):
        class_named("std_msgs/Nothing")


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


# Figures of a topic statistics window, and the adaptation of its length to the traffic.


S = 1_000_000_000


def run(meter: TrafficMeter, seconds: float, rate: int, start_ns: int = S) -> list[StatisticsWindow]:
    """Feed a steady stream of messages of 10 bytes, each a millisecond old."""
    windows = []
    for number in range(int(seconds * rate)):
        now_ns = start_ns + number * S // rate
        if window := meter.add(now_ns, 10, number, now_ns - 1_000_000):
            windows.append(window)
    return windows


def test_a_steady_stream_is_described() -> None:
    window = run(TrafficMeter(), 1.1, 20)[0]
    assert (window.delivered, window.dropped, window.bytes) == (21, 0, 210)
    assert (window.period_mean_s, window.period_stddev_s) == (pytest.approx(0.05), pytest.approx(0))
    assert (window.age_mean_s, window.age_max_s) == (pytest.approx(0.001), pytest.approx(0.001))
    assert (window.start_ns, window.stop_ns) == (S, 2 * S)


def test_gaps_in_the_sequence_are_dropped_messages() -> None:
    meter = TrafficMeter()
    for second, sequence in ((1, 1), (1, 2), (1, 5)):
        assert meter.add(second * S, 1, sequence, None) is None
    window = meter.add(2 * S, 1, 6, None)
    assert (window.dropped, window.age_max_s) == (2, 0)


def test_a_window_with_too_few_messages_grows_up_to_the_limit() -> None:
    meter = TrafficMeter(WindowLimits(min_elements=10, max_size_s=8.0))
    run(meter, 60, 1)
    assert meter.window_s == 8.0


def test_a_window_with_too_many_messages_shrinks() -> None:
    meter = TrafficMeter(WindowLimits(max_elements=100, min_size_s=1.0), window_s=4.0)
    run(meter, 20, 200)
    assert meter.window_s == 1.0


def test_a_window_starts_again_if_the_time_moves_back() -> None:
    meter = TrafficMeter()
    run(meter, 0.5, 20, 100 * S)
    (window,) = run(meter, 1.1, 20)
    assert (window.start_ns, window.delivered) == (S, 21)


class Published:
    def __init__(self) -> None:
        self.messages: list[Any] = []

    def publish(self, message: Any) -> None:
        message._to_buffers()  # every field keeps its value
        self.messages.append(message)


def arrivals(published: Published, count: int, *, stamp_ns: int, step: int) -> None:
    now = [0]
    statistics = StatisticsPublisher(
        "/listener", lambda *_, **__: published, lambda: now[0], WindowLimits(), max_links=10
    )
    for number in range(count):
        now[0] += 500_000_000
        stamp = SimpleNamespace(to_nsec=lambda: stamp_ns)
        header = SimpleNamespace(seq=1 + number % 2 * step, stamp=stamp)
        statistics.arrived(
            "/chat", {"callerid": "/talker"}, 2**31, SimpleNamespace(_has_header=True, header=header)
        )


def test_figures_beyond_the_range_of_their_fields_are_clamped() -> None:
    published = Published()
    arrivals(published, 10, stamp_ns=2**32 * 1_000_000_000, step=2**32 - 2)
    first = published.messages[0]
    assert (first.dropped_msgs, first.traffic) == (2**31 - 1, 2**31 - 1)
    assert first.stamp_age_mean.secs == -(2**31) + 1


def test_the_number_of_remembered_links_is_bounded() -> None:
    published = Published()
    statistics = StatisticsPublisher(
        "/listener", lambda *_, **__: published, lambda: 1, WindowLimits(), max_links=10
    )
    for number in range(1000):
        statistics.arrived("/chat", {"callerid": f"/talker_{number}"}, 1, SimpleNamespace())
    assert len(statistics._meters) == 10
    assert ("/chat", "/talker_999") in statistics._meters
