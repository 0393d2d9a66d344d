"""The messages of one topic for one client, without a node."""

import json
import threading
from collections.abc import Callable
from typing import Any

from pipros.msg import load_message_class
from pipros_bridges.outbox import ClientOutbox, text_frame
from pipros_bridges.rosbridge.effects import DeliveryOptions
from pipros_bridges.rosbridge.encoding import Encoder
from pipros_bridges.rosbridge.streams import TopicStream
from pipros_bridges.shared_topics import TopicMessage

STRING: Any = load_message_class("std_msgs/String")


class Eager:
    """Topics whose first messages arrive in another thread while `take` is still running."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._threads: list[threading.Thread] = []

    def take(self, topic: str, kind: str | None, on_message: Callable[[Any], object], *_: Any) -> Any:
        def deliver() -> None:
            for _ in range(self._count):
                on_message(TopicMessage(topic, b"\1\0\0\0x", header, 0))

        header = {"type": STRING._type, "md5sum": STRING._md5sum}
        self._threads.append(threading.Thread(target=deliver))
        self._threads[-1].start()
        self._threads[-1].join(0.5)  # they may all arrive, or wait for `take`
        return object()

    def wait(self) -> None:
        for thread in self._threads:
            thread.join()


def test_a_closed_stream_does_not_begin_again() -> None:
    topics: Any = Eager(1)
    outbox = ClientOutbox(1000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, lambda *_: None)
    stream.close()
    stream.take(None, DeliveryOptions())
    topics.wait()
    assert outbox.pop() is None


def test_messages_that_arrive_at_once_are_throttled_too() -> None:
    topics: Any = Eager(3)
    outbox = ClientOutbox(1000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, lambda *_: None)
    stream.take(None, DeliveryOptions(throttle_s=100.0))
    topics.wait()
    assert outbox.pop() is not None
    assert outbox.pop() is None


class Manual:
    """Topics whose messages the test delivers, and timers that it runs."""

    def __init__(self) -> None:
        self.on_message: Callable[[Any], object] = print
        self.timers: list[Callable[[], object]] = []

    def take(self, topic: str, kind: str | None, on_message: Callable[[Any], object], *_: Any) -> Any:
        self.on_message = on_message
        return Manual()

    def call_later(self, _: float, function: Callable[[], object]) -> None:
        self.timers.append(function)

    def close(self) -> None:
        pass

    topic = "/x"


def text_of(number: int, size: int) -> TopicMessage:
    header = {"type": STRING._type, "md5sum": STRING._md5sum}
    body = b"".join(STRING(f"{number:04}".ljust(size - 4))._to_buffers())
    return TopicMessage("/x", body, header, 0)


def sent(outbox: ClientOutbox) -> list[str]:
    """Pop all messages, and return the first words of their texts."""
    found = []
    while (frames := outbox.pop()) is not None:
        found.append(json.loads(frames[0].parts[0])["msg"]["data"][:4])
    return found


def test_throttled_messages_count_as_part_of_the_queue() -> None:
    topics: Any = Manual()
    outbox = ClientOutbox(20_000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, topics.call_later)
    stream.take(None, DeliveryOptions(throttle_s=1e6, queue_length=10**9))
    for number in range(100):
        topics.on_message(text_of(number, 1000))
    assert sent(outbox) == ["0000"]
    assert 5000 < outbox.waiting_bytes <= 10_000
    outbox.answer(text_frame("y" * 9000))
    assert not outbox.is_overrun
    outbox.pop()
    while topics.timers:
        topics.timers.pop()()
    assert sent(outbox) == [f"{number:04}" for number in range(94, 100)]
    assert outbox.waiting_bytes == 0

    topics.on_message(text_of(1, 50_000))  # too large: the newest one is kept in any case
    topics.on_message(text_of(2, 50_000))
    topics.timers.pop()()
    assert sent(outbox) == ["0002"]

    topics.on_message(text_of(3, 1000))
    assert outbox.waiting_bytes
    stream.close()
    assert outbox.waiting_bytes == 0
