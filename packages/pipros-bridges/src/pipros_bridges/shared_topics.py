"""Topics that the clients of a bridge receive. All clients share one ROS subscription per topic.

The node shares its subscriptions, and passes latched messages to callbacks that are added later. This module
adds four guarantees for bridges: subscribing never blocks, because a thread calls the master; a client that
subscribes and unsubscribes often delays only itself, because that thread serves the clients in turn; all
clients of a topic share one object per message, which includes the time of arrival; and a client that expects
a type never receives messages of other types.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from pipros.basics import names
from pipros.basics.errors import InvalidName, PiprosError
from pipros.basics.printable import printable
from pipros.basics.turns import Turns
from pipros.net.master_client import MasterClient
from pipros.net.workers import Workers
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.subscriber import Subscriber
from pipros_bridges.rosapi import MASTER_DEADLINE_S
from pipros_bridges.shares import BRIDGE_TOPICS, TopicShares


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
callbacks of the topic wait for it; it adds the message to a `ClientOutbox`. The node logs its exceptions.
"""
OnError = Callable[[PiprosError], object]
"""Called in the same thread as `OnMessage`."""

PENDING_CHANGES: Final = 32
"""A client with this many pending subscriptions and unsubscriptions has to wait for its turn."""
REPORTED_TYPES: Final = 10
"""Maximum number of wrong types that are reported for one subscription."""


def legal_topic(node: Node, name: str) -> str:
    """Resolve a topic name in a client's request to a global name.

    Raises:
        InvalidName: the name is not legal.
    """
    if not name or not names.is_legal(name):
        raise InvalidName(f"[{printable(name)}] is not a legal topic name")
    return node.resolve(name)


def check_published_type(node: Node, topic: str, kind: str) -> None:
    """Refuse a type that would replace, at the master, the type of other nodes' publishers. Blocks.

    Raises:
        PiprosError: the topic is published with another type.
    """
    name = node.resolve(topic)
    try:
        published = dict(node.master.get_published_topics())
    except (PiprosError, OSError):  # registering the publisher waits for the master
        return
    known = published.get(name, "*")
    if known not in ("*", kind):
        raise PiprosError(f"{name} is already published with the type {known}, not {kind}")


class SharedTopics:
    """Subscriptions shared by a bridge's clients. Thread-safe. Only `type_of` and `wait_for_turn` block."""

    def __init__(self, node: Node, *, reports_types: bool = True) -> None:
        """Create an empty set of subscriptions.

        Args:
            reports_types: whether types that clients expect are registered at the master, where they become
                the types of topics without publishers.
        """
        self._node = node
        self._master = MasterClient(node.master.uri, node.name, timeout_s=MASTER_DEADLINE_S)
        self._reports_types = reports_types
        self._lock = threading.Lock()
        self._topics = TopicShares(BRIDGE_TOPICS)
        self._reported: dict[str, str] = {}  # the types registered at the master
        self._newest: dict[str, tuple[AnyMsg, TopicMessage]] = {}
        self._changes: Turns[Hashable, tuple[bool, Taken]] = Turns()
        self._turn = threading.Condition(self._lock)
        self._is_changing = False
        self._is_closed = False
        self._workers = Workers("subscriptions of a bridge", 1)

    def take(
        self,
        topic: str,
        kind: str | None,
        on_message: OnMessage,
        on_error: OnError | None = None,
        user: Hashable = None,
        replaces: Taken | None = None,
    ) -> Taken:
        """Call `on_message` with each message of a topic, beginning with latched messages.

        Args:
            topic: a name, resolved by the node.
            kind: the expected type; None accepts any type.
            on_error: called with a `WrongType`, once for each other type that is published on the topic, but
                for at most `REPORTED_TYPES` types.
            user: the client, for its share of topics and its turns.
            replaces: an earlier subscription, which is closed as soon as the new one exists.

        Raises:
            InvalidName: `topic` is not a legal name.
            LimitExceeded: the client has used up its share of `BRIDGE_TOPICS`.
        """
        name = legal_topic(self._node, topic)
        taken = Taken(self, name, kind, on_message, on_error, user)
        with self._lock:
            self._topics.enter(name, user)
            if replaces is not None and not replaces.is_begun:
                taken.replaces, replaces.replaces = replaces.replaces, None
            else:
                taken.replaces, replaces = replaces, None
        if replaces is not None:  # `replaces` never began, so its predecessor still receives the messages
            replaces.close()
        self._change(taken, is_begin=True)
        return taken

    def wait_for_turn(self, user: Hashable) -> None:
        """Wait until fewer than `PENDING_CHANGES` changes of this user are pending, or `close` is called."""
        with self._lock:
            self._turn.wait_for(lambda: self._is_closed or self._changes.waiting(user) < PENDING_CHANGES)

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
            return self._topics.counts()

    def close(self) -> None:
        """Ignore all later changes. The node's shutdown ends the subscriptions."""
        with self._lock:
            self._is_closed = True
            self._turn.notify_all()
        self._workers.close()
        self._master.close()

    def _change(self, taken: Taken, *, is_begin: bool) -> None:
        """Schedule the beginning or end of a subscription in the thread."""
        with self._lock:
            self._changes.put(taken.user, (is_begin, taken))
            if self._is_changing:
                return
            self._is_changing = True
        self._workers.run(self._make_changes)

    def _make_changes(self) -> None:
        """Make the pending changes of all users in turn."""
        while True:
            with self._lock:
                if not len(self._changes):
                    self._is_changing = False
                    return
                _, (is_begin, taken) = self._changes.pop()
                self._turn.notify_all()
                if is_begin and taken.is_closed:
                    continue
                taken.is_begun = True
            try:
                (self._subscribe if is_begin else self._unsubscribe)(taken)
            except Exception:
                self._node.log.exception("a subscription of a bridge failed")
            else:
                if is_begin:  # after an error, the replaced subscription stays
                    self._end_replaced(taken)

    def _subscribe(self, taken: Taken) -> None:
        if not self._node.is_ending:
            taken.subscriber = self._node.subscribe(taken.topic, AnyMsg, taken.deliver)
            is_reported = self._reported.get(taken.topic) == taken.kind
            if taken.kind is not None and self._reports_types and not is_reported:
                self._reported[taken.topic] = taken.kind
                self._report_type(taken.topic, taken.kind)

    def _end_replaced(self, taken: Taken) -> None:
        with self._lock:
            replaced, taken.replaces = taken.replaces, None
        if replaced is not None:
            replaced.close()

    def _report_type(self, topic: str, kind: str) -> None:
        """Register the expected type with the master, so that `rostopic type` shows it."""
        with suppress(PiprosError):  # the registration is for information only
            self._master.register_subscriber(topic, kind, self._node.uri)
            if self._node.is_ending:  # the node may have just unregistered its topics
                self._master.unregister_subscriber(topic, self._node.uri)

    def _release(self, taken: Taken) -> None:
        with self._lock:
            if taken.is_closed:
                return
            taken.is_closed = True
            is_begun = taken.is_begun
            if not is_begun:
                self._forget(taken)
        if is_begun:
            self._change(taken, is_begin=False)
        self._end_replaced(taken)

    def _unsubscribe(self, taken: Taken) -> None:
        subscriber, taken.subscriber = taken.subscriber, None  # break a reference cycle
        if subscriber is not None and not self._node.is_ending:
            subscriber.unregister()
        with self._lock:
            self._forget(taken)

    def _forget(self, taken: Taken) -> None:
        if self._topics.leave(taken.topic, taken.user):
            self._newest.pop(taken.topic, None)
            self._reported.pop(taken.topic, None)

    def _message_of(self, topic: str, raw: AnyMsg) -> TopicMessage:
        """Return the shared object for a message. Messages on a topic are delivered one at a time."""
        newest = self._newest.get(topic)
        if newest is not None and newest[0] is raw:
            return newest[1]
        message = TopicMessage(topic, raw.body, raw.header, self._node.clock.now_ns())
        if topic in self._topics:
            self._newest[topic] = raw, message
        return message


class Taken:
    """One client's subscription to one topic.

    Attributes:
        topic: global name.
        kind: the expected type; None accepts any type.
        user: the client.
        subscriber: the node's subscriber, once it exists. For use by `SharedTopics` only.
        is_begun: whether subscribing has begun. For use by `SharedTopics` only.
        replaces: the subscription to close as soon as this one exists. For use by `SharedTopics` only.
        is_closed: whether `close` was called.
    """

    # A client may have thousands of these objects.
    __slots__ = (
        *("_on_error", "_on_message", "_topics", "_wrong_types", "is_begun", "is_closed", "kind"),
        *("replaces", "subscriber", "topic", "user"),
    )

    def __init__(
        self,
        topics: SharedTopics,
        topic: str,
        kind: str | None,
        on_message: OnMessage,
        on_error: OnError | None,
        user: Hashable,
    ) -> None:
        self.topic = topic
        self.user = user
        self.subscriber: Subscriber[AnyMsg] | None = None
        self.is_begun = False
        self.replaces: Taken | None = None
        self.is_closed = False
        self._topics = topics
        self.kind = kind
        self._on_message = on_message
        self._on_error = on_error
        self._wrong_types: tuple[str, ...] = ()

    def close(self) -> None:
        """Stop calling `on_message`. A call in progress is not interrupted. May be called repeatedly."""
        self._topics._release(self)

    def deliver(self, raw: AnyMsg) -> None:
        """Pass a message on if it has the expected type."""
        if self.is_closed:
            return
        kind = raw.header.get("type", "*")
        if self.kind is None or kind == self.kind:
            self._on_message(self._topics._message_of(self.topic, raw))
        elif kind not in self._wrong_types and len(self._wrong_types) < REPORTED_TYPES:
            self._wrong_types = (*self._wrong_types, kind)
            if self._on_error is not None:
                self._on_error(
                    WrongType(
                        f"[{self.topic}]: {printable(raw.header.get('callerid', 'a node'))} publishes "
                        f"[{printable(kind)}] instead of [{self.kind}]"
                    )
                )
