"""Topics that the clients of a bridge receive, with one ROS subscription per topic for all of them.

The node shares the subscription, and gives latched messages to later callbacks too. This module adds what
bridges need: subscribing never blocks, because a thread calls the master; a message and its time of arrival
are one object for all takers; and a taker that expects a type gets no messages of another.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from pipros.basics import names
from pipros.basics.errors import InvalidName, LimitExceeded, PiprosError
from pipros.basics.limits import limit_text
from pipros.basics.printable import printable
from pipros.bridges.rosapi import MASTER_DEADLINE_S
from pipros.net.master_client import MasterClient
from pipros.net.workers import Workers
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.subscriber import Subscriber


class WrongType(PiprosError):
    """A publisher's type is not the one that a taker expects."""


@dataclass(frozen=True, slots=True, eq=False)
class TopicMessage:
    """A serialized message. All takers of a topic get the same object for one message.

    Attributes:
        topic: global name.
        body: the serialized message.
        header: the publisher's connection header: `type`, `md5sum`, `message_definition`, `callerid`, ….
        received_ns: time of arrival by the node's clock, which may be simulated.
    """

    topic: str
    body: bytes
    header: Mapping[str, str]
    received_ns: int

    @property
    def is_latched(self) -> bool:
        return self.header.get("latching") == "1"


OnMessage = Callable[[TopicMessage], object]
"""Called in a thread of the node, one message of a topic at a time. It must not block, because the other
takers of the topic wait for it; it adds the message to an `Outbox`. Errors are logged by the node.
"""
OnError = Callable[[PiprosError], object]
"""Called in the same thread."""

REPORTED_TYPES: Final = 10
"""Maximum number of wrong types that are reported to one taker."""


def legal_topic(node: Node, name: str) -> str:
    """Return the global name of a topic in a request of a client.

    Raises:
        InvalidName: it is not a legal name.
    """
    if not name or not names.is_legal(name):
        raise InvalidName(f"[{printable(name)}] is not a legal topic name")
    return node.resolve(name)


class SharedTopics:
    """The topics that clients take. Thread-safe. All methods except `type_of` return at once."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._master = MasterClient(node.master.uri, node.name, timeout_s=MASTER_DEADLINE_S)
        self._limit = node.limits.bridge_topics
        self._lock = threading.Lock()
        self._takers: Counter[str] = Counter()
        self._newest: dict[str, tuple[AnyMsg, TopicMessage]] = {}
        self._changes = Workers("subscriptions of a bridge", 1)  # one thread keeps their order

    def take(
        self, topic: str, kind: str | None, on_message: OnMessage, on_error: OnError | None = None
    ) -> Taken:
        """Call `on_message` with each message of a topic, beginning with those that are latched.

        Args:
            topic: a name, resolved by the node.
            kind: the expected type. None takes any.
            on_error: called with a `WrongType`, once for each other type that is published on the topic.

        Raises:
            InvalidName: `topic` is not a legal name.
            LimitExceeded: `Limits.bridge_topics` topics are taken already.
        """
        name = legal_topic(self._node, topic)
        with self._lock:
            if name not in self._takers and len(self._takers) >= self._limit:
                raise LimitExceeded(
                    f"too many topics are subscribed; {limit_text('bridge_topics', self._limit)}"
                )
            self._takers[name] += 1
        taken = Taken(self, name, kind, on_message, on_error)
        self._changes.run(self._subscribe, taken)
        return taken

    def type_of(self, topic: str) -> str | None:
        """Return the type of a topic, by its newest message or else by the master. Blocks; None if unknown.

        Raises:
            PiprosError: the master does not answer.
        """
        name = self._node.resolve(topic)
        newest = self._newest.get(name)
        if newest is not None and newest[1].header.get("type", "*") != "*":
            return newest[1].header["type"]
        kinds = (kind for topic, kind in self._master.get_topic_types() if topic == name and kind != "*")
        return next(kinds, None)

    def counts(self) -> Mapping[str, int]:
        """Return the number of takers of each topic."""
        with self._lock:
            return dict(self._takers)

    def close(self) -> None:
        """Make no more changes. The node's shutdown ends the subscriptions."""
        self._changes.close()
        self._master.close()

    def _subscribe(self, taken: Taken) -> None:
        if not taken.is_closed and not self._node.is_ending:
            taken.subscriber = self._node.subscribe(taken.topic, AnyMsg, taken.deliver)
            if taken.kind is not None:
                self._report_type(taken.topic, taken.kind)

    def _report_type(self, topic: str, kind: str) -> None:
        """Register the expected type; the master keeps it if it knows none, for `rostopic list`."""
        with suppress(PiprosError):  # it only informs
            self._master.register_subscriber(topic, kind, self._node.uri)
            if self._node.is_ending:  # the node may have unregistered before
                self._master.unregister_subscriber(topic, self._node.uri)

    def _release(self, taken: Taken) -> None:
        self._changes.run(self._unsubscribe, taken)

    def _unsubscribe(self, taken: Taken) -> None:
        if taken.subscriber is not None and not self._node.is_ending:
            taken.subscriber.unregister()
        with self._lock:
            self._takers[taken.topic] -= 1
            if not self._takers[taken.topic]:
                del self._takers[taken.topic]
                self._newest.pop(taken.topic, None)

    def _message_of(self, topic: str, raw: AnyMsg) -> TopicMessage:
        """Return the one object that stands for a message. A topic delivers one message at a time."""
        newest = self._newest.get(topic)
        if newest is not None and newest[0] is raw:
            return newest[1]
        message = TopicMessage(topic, raw.body, raw.header, self._node.clock.now_ns())
        if topic in self._takers:
            self._newest[topic] = raw, message
        return message


class Taken:
    """One taker of one topic.

    Attributes:
        topic: global name.
        kind: the expected type; None for any.
        subscriber: the handle on the node's subscription, once it exists. For `SharedTopics`.
        is_closed: whether `close` was called.
    """

    def __init__(
        self,
        topics: SharedTopics,
        topic: str,
        kind: str | None,
        on_message: OnMessage,
        on_error: OnError | None,
    ) -> None:
        self.topic = topic
        self.subscriber: Subscriber[AnyMsg] | None = None
        self.is_closed = False
        self._topics = topics
        self.kind = kind
        self._on_message = on_message
        self._on_error = on_error
        self._wrong_types: set[str] = set()
        self._lock = threading.Lock()

    def close(self) -> None:
        """End the calls of `on_message`, except one that may be running. May be called repeatedly."""
        with self._lock:
            if self.is_closed:
                return
            self.is_closed = True
        self._topics._release(self)

    def deliver(self, raw: AnyMsg) -> None:
        """Pass a message on, unless its type is not the expected one."""
        if self.is_closed:
            return
        kind = raw.header.get("type", "*")
        if self.kind is None or kind == self.kind:
            self._on_message(self._topics._message_of(self.topic, raw))
        elif kind not in self._wrong_types and len(self._wrong_types) < REPORTED_TYPES:
            self._wrong_types.add(kind)
            if self._on_error is not None:
                self._on_error(
                    WrongType(
                        f"[{self.topic}]: {printable(raw.header.get('callerid', 'a node'))} publishes "
                        f"[{printable(kind)}], which is not [{self.kind}]"
                    )
                )
