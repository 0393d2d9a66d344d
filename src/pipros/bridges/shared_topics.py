"""Topics that the clients of a bridge receive. All clients share one ROS subscription per topic.

The node shares its subscriptions, and passes latched messages to callbacks that are added later. This module
adds three guarantees for bridges: subscribing never blocks, because a thread calls the master; all clients of
a topic share one object per message, which includes the time of arrival; and a client that expects a type
never receives messages of other types.
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
    """The publisher's message type differs from the type that a client expects."""


@dataclass(frozen=True, slots=True, eq=False)
class TopicMessage:
    """A serialized message. All clients of a topic receive the same object.

    Attributes:
        topic: global name.
        body: the serialized message.
        header: the publisher's connection header: `type`, `md5sum`, `message_definition`, `callerid`, ….
        received_ns: time of arrival according to the node's clock, which may be simulated.
    """

    topic: str
    body: bytes
    header: Mapping[str, str]
    received_ns: int

    @property
    def is_latched(self) -> bool:
        return self.header.get("latching") == "1"


OnMessage = Callable[[TopicMessage], object]
"""Called in a thread of the node, for one message of a topic at a time. It must not block, because the other
callbacks of the topic wait for it; it adds the message to an `Outbox`. The node logs its exceptions.
"""
OnError = Callable[[PiprosError], object]
"""Called in the same thread as `OnMessage`."""

REPORTED_TYPES: Final = 10
"""Maximum number of wrong types that are reported to one client."""


def legal_topic(node: Node, name: str) -> str:
    """Resolve a topic name in a client's request to a global name.

    Raises:
        InvalidName: the name is not legal.
    """
    if not name or not names.is_legal(name):
        raise InvalidName(f"[{printable(name)}] is not a legal topic name")
    return node.resolve(name)


class SharedTopics:
    """Subscriptions shared by the clients of a bridge. Thread-safe. Only `type_of` blocks."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._master = MasterClient(node.master.uri, node.name, timeout_s=MASTER_DEADLINE_S)
        self._limit = node.limits.bridge_topics
        self._lock = threading.Lock()
        self._takers: Counter[str] = Counter()
        self._newest: dict[str, tuple[AnyMsg, TopicMessage]] = {}
        self._changes = Workers("subscriptions of a bridge", 1)  # a single thread keeps the changes in order

    def take(
        self, topic: str, kind: str | None, on_message: OnMessage, on_error: OnError | None = None
    ) -> Taken:
        """Call `on_message` with each message of a topic, beginning with latched messages.

        Args:
            topic: a name, resolved by the node.
            kind: the expected type; None accepts any type.
            on_error: called with a `WrongType`, once for each other type that is published on the topic.

        Raises:
            InvalidName: `topic` is not a legal name.
            LimitExceeded: `Limits.bridge_topics` topics are already subscribed to.
        """
        name = legal_topic(self._node, topic)
        with self._lock:
            if name not in self._takers and len(self._takers) >= self._limit:
                raise LimitExceeded(f"too many subscribed topics; {limit_text('bridge_topics', self._limit)}")
            self._takers[name] += 1
        taken = Taken(self, name, kind, on_message, on_error)
        self._changes.run(self._subscribe, taken)
        return taken

    def type_of(self, topic: str) -> str | None:
        """Return a topic's type, from its newest message or from the master, or None if unknown. Blocks.

        Raises:
            PiprosError: the master does not respond.
        """
        name = self._node.resolve(topic)
        newest = self._newest.get(name)
        if newest is not None and newest[1].header.get("type", "*") != "*":
            return newest[1].header["type"]
        kinds = (kind for topic, kind in self._master.get_topic_types() if topic == name and kind != "*")
        return next(kinds, None)

    def counts(self) -> Mapping[str, int]:
        """Return the number of subscriptions to each topic."""
        with self._lock:
            return dict(self._takers)

    def close(self) -> None:
        """Ignore all later changes. The node's shutdown ends the subscriptions."""
        self._changes.close()
        self._master.close()

    def _subscribe(self, taken: Taken) -> None:
        if not taken.is_closed and not self._node.is_ending:
            taken.subscriber = self._node.subscribe(taken.topic, AnyMsg, taken.deliver)
            if taken.kind is not None:
                self._report_type(taken.topic, taken.kind)

    def _report_type(self, topic: str, kind: str) -> None:
        """Register the expected type with the master, so that `rostopic list` shows it."""
        with suppress(PiprosError):  # the registration is for information only
            self._master.register_subscriber(topic, kind, self._node.uri)
            if self._node.is_ending:  # the node may have just unregistered its topics
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
        """Return the shared object for a message. Messages on a topic are delivered one at a time."""
        newest = self._newest.get(topic)
        if newest is not None and newest[0] is raw:
            return newest[1]
        message = TopicMessage(topic, raw.body, raw.header, self._node.clock.now_ns())
        if topic in self._takers:
            self._newest[topic] = raw, message
        return message


class Taken:
    """One client's subscription to one topic.

    Attributes:
        topic: global name.
        kind: the expected type; None accepts any type.
        subscriber: the node's subscriber, once it exists. For use by `SharedTopics` only.
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
        """Stop calling `on_message`. A call in progress is not interrupted. May be called repeatedly."""
        with self._lock:
            if self.is_closed:
                return
            self.is_closed = True
        self._topics._release(self)

    def deliver(self, raw: AnyMsg) -> None:
        """Pass a message on if it has the expected type."""
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
                        f"[{printable(kind)}] instead of [{self.kind}]"
                    )
                )
