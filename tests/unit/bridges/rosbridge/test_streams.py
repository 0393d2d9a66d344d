"""The messages of one topic for one client, without a node."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from pipros.bridges.outbox import ClientOutbox
from pipros.bridges.rosbridge.effects import Delivery
from pipros.bridges.rosbridge.encoding import Encoder
from pipros.bridges.rosbridge.streams import TopicStream
from pipros.bridges.shared_topics import TopicMessage
from pipros.msg import load_message_class

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
    stream.take(None, Delivery())
    topics.wait()
    assert outbox.pop() is None


def test_messages_that_arrive_at_once_are_throttled_too() -> None:
    topics: Any = Eager(3)
    outbox = ClientOutbox(1000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, lambda *_: None)
    stream.take(None, Delivery(throttle_s=100.0))
    topics.wait()
    assert outbox.pop() is not None
    assert outbox.pop() is None
