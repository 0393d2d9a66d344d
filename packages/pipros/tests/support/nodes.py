"""Callbacks and waits for tests with nodes in the test's process."""

import logging
from collections.abc import Callable
from typing import Any

from pipros.node import Node, Publisher
from tests.support.waiting import wait_until

MakeNode = Callable[..., Node]


class Inbox:
    """A callback that stores the messages."""

    def __init__(self) -> None:
        self.messages: list[Any] = []
        self.subscriber: Any = None

    @classmethod
    def of(cls, node: Node, topic: str, message_class: Any, **options: Any) -> "Inbox":
        """Subscribe a node to a topic, and return the callback."""
        inbox = cls()
        inbox.subscriber = node.subscribe(topic, message_class, inbox, **options)
        return inbox

    def __call__(self, message: Any) -> None:
        self.messages.append(message)

    def wait(self, count: int = 1) -> list[Any]:
        """Wait until at least `count` messages have arrived. Return all messages."""
        wait_until(lambda: len(self.messages) >= count, what=lambda: f"got {len(self.messages)} of {count}")
        return self.messages


def wait_until_connected(handle: Any, count: int = 1) -> None:
    """Wait until a publisher or subscriber has at least `count` links."""
    wait_until(lambda: handle.connection_count >= count)


def connected(
    talker: Node,
    listener: Node,
    topic: str,
    message_class: Any,
    callback: Callable[[Any], object],
    **options: Any,
) -> Publisher[Any]:
    """Subscribe one node to a topic of another. Return the publisher once they are connected."""
    listener.subscribe(topic, message_class, callback)
    publisher = talker.advertise(topic, message_class, **options)
    wait_until_connected(publisher)
    return publisher


def listening_log() -> tuple[logging.Logger, list[str]]:
    """Return a logger, and a list to which its messages are added."""
    log = logging.Logger("test")
    return log, listen(log)


def listen(log: logging.Logger) -> list[str]:
    """Return a list to which the messages of a logger are added."""
    lines: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
    log.addHandler(handler)
    return lines
