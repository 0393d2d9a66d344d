"""Small messages of a burst, collected so that one system call per link sends several of them.

For each subscriber, a send costs about as much as everything else that `publish` does. During a burst
(`pipros.node.packet_sharing`), messages are therefore collected, and sent

- with the eighth message;
- with the first message that follows after 100 microseconds or more;
- at the latest after about a millisecond, by the event loop.

A message is sent at once, after the messages collected before it, if the topic has been quiet, or if the node
has received a message since it last published on the topic: the subscriber may be waiting for a reply. A node
that ends, unregisters or forks sends the collected messages first; `os._exit` and SIGKILL lose them.
"""

from __future__ import annotations

import atexit
import os
import sys
import weakref
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from pipros.net.backlog import Buffer

MAX_MESSAGES: Final = 8
MAX_AGE_S: Final = 100e-6


class MessageBatch:
    """The messages that a topic has collected. Not thread-safe.

    Attributes:
        messages: the messages, each with its length field, in the order in which they were published.
    """

    __slots__ = ("_since_s", "messages")

    def __init__(self) -> None:
        self.messages: list[Buffer] = []
        self._since_s = 0.0

    def add(self, message: Buffer, now_s: float) -> bool:
        """Add a message. Return True if the batch must be sent now."""
        messages = self.messages
        if not messages:
            self._since_s = now_s
        messages.append(message)
        return len(messages) >= MAX_MESSAGES or now_s - self._since_s >= MAX_AGE_S

    def take(self) -> list[Buffer]:
        """Remove the messages and return them."""
        messages, self.messages = self.messages, []
        return messages


class Batching(Protocol):
    """A topic that collects messages. A protocol because `Publication` imports this module."""

    def flush(self) -> None:
        """Send the collected messages. Does not block for long."""


_topics: weakref.WeakSet[Batching] = weakref.WeakSet()


def flush_at_exit_and_fork(topic: Batching) -> None:
    """Send the messages that `topic` has collected before this process ends normally or forks."""
    if not _topics:
        atexit.unregister(_flush_all)
        atexit.register(_flush_all)
    _topics.add(topic)


def _flush_all() -> None:
    for topic in list(_topics):
        topic.flush()


if sys.platform != "win32" and hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_flush_all)
