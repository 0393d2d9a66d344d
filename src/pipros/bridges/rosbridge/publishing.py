"""Topics that clients publish. For each topic, the node has one publisher, which all clients share.

A publisher is kept for a while after its last client has left, because pages are reloaded. Messages that a
client publishes right after `advertise` wait until a subscriber has connected, for at most `EARLY_S`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from typing import Any, Final

from pipros.basics.errors import LimitExceeded, PiprosError
from pipros.basics.limits import limit_text
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.rosbridge.filling import Filler
from pipros.msg import load_message_class
from pipros.node import Node

EARLY_S: Final = 1.0
"""Maximum time (s) that the first messages of a publisher wait for a subscriber."""
EARLY_BYTES: Final = 8 * 1024 * 1024
GATHERING_S: Final = 0.1
"""Time (s) that the first messages wait for more subscribers after the first one has connected."""

CallLater = Callable[[float, Callable[[], object]], object]
"""Calls a function in another thread after a delay in seconds. The function may block."""
TypeOf = Callable[[str], str | None]


class UnknownTopic(PiprosError):
    """A client publishes on a topic whose type is unknown."""


class SharedPublishers:
    """The publishers of all clients. Methods may be called from any thread, and may block."""

    def __init__(
        self, node: Node, filler: Filler, type_of: TypeOf, call_later: CallLater, unregister_s: float
    ) -> None:
        """Start without publishers. `unregister_s` is how long (s) a publisher without clients is kept."""
        self._node = node
        self._filler = filler
        self._type_of = type_of
        self._call_later = call_later
        self._unregister_s = unregister_s
        self._limit = node.limits.of(BridgeLimits).bridge_topics
        self._shared: dict[str, _SharedPublisher] = {}
        self._lock = threading.Lock()

    def advertise(self, user: Hashable, topic: str, kind: str, *, latch: bool, queue_size: int) -> None:
        """Advertise a topic (a global name) for a client.

        Raises:
            PiprosError: the type is unknown or differs from the topic's type, or there are too many topics.
        """
        message_class = load_message_class(kind)
        with self._lock:
            found = self._shared.get(topic)
            if found is None:
                self._make_room()
                found = self._shared[topic] = _SharedPublisher(
                    self._node, topic, message_class, latch, queue_size, self._call_later
                )
            elif found.message_class._type != message_class._type:
                raise PiprosError(f"{topic} is already advertised with the type {found.message_class._type}")
            found.users.add(user)
        if latch:
            found.latch()

    def publish(
        self, user: Hashable, topic: str, values: Any, *, latch: bool | None, queue_size: int
    ) -> None:
        """Publish a message. If necessary, advertise its topic first, with the type registered at the master.

        Raises:
            PiprosError: a value does not fit its field, or the topic cannot be advertised; see `advertise`.
        """
        found = self._shared.get(topic)
        if found is None or user not in found.users:
            kind = found.message_class._type if found is not None else self._type_of(topic)
            if kind is None:
                raise UnknownTopic(f"the type of {topic} is unknown; advertise it before publishing")
            self.advertise(user, topic, kind, latch=bool(latch), queue_size=queue_size)
            found = self._shared[topic]
        elif latch:
            found.latch()
        message = found.message_class()
        self._filler.fill(message, values)
        found.publish(message)

    def release(self, user: Hashable, topic: str) -> None:
        """Remove a client from the users of a publisher.

        A publisher without users is unregistered after `unregister_s`.
        """
        with self._lock:
            found = self._shared.get(topic)
            if found is None or user not in found.users:
                return
            found.users.discard(user)
            if found.users:
                return
            found.unused_since_s = time.monotonic()
        self._call_later(self._unregister_s, lambda: self._unregister_unused(topic))

    def _unregister_unused(self, topic: str) -> None:
        with self._lock:
            found = self._shared.get(topic)
            overdue_s = time.monotonic() - self._unregister_s
            if found is None or found.users or found.unused_since_s > overdue_s:
                return
            del self._shared[topic]
        found.close()

    def _make_room(self) -> None:
        """If there are too many publishers, unregister the one that has been unused for the longest time.

        Raises:
            LimitExceeded: all publishers are in use.
        """
        if len(self._shared) < self._limit:
            return
        unused = [topic for topic, shared in self._shared.items() if not shared.users]
        if not unused:
            limit = limit_text("bridge_topics", self._limit)
            raise LimitExceeded(f"too many topics are advertised; {limit}")
        self._shared.pop(min(unused, key=lambda topic: self._shared[topic].unused_since_s)).close()


class _SharedPublisher:
    """A publisher of the node, with messages waiting for its first subscriber."""

    def __init__(
        self,
        node: Node,
        topic: str,
        message_class: Any,
        latch: bool,
        queue_size: int,
        call_later: CallLater,
    ) -> None:
        self.message_class = message_class
        self.users: set[Hashable] = set()
        self.unused_since_s = 0.0
        self._node = node
        self._topic = topic
        self._queue_size = max(queue_size, 1)
        self._call_later = call_later
        self._is_latching = latch
        self._publisher = node.advertise(topic, message_class, queue_size=self._queue_size, latch=latch)
        self._early_until_s = time.monotonic() + EARLY_S
        self._early: list[Any] = []
        self._early_bytes = 0
        self._lock = threading.Lock()
        self._publisher.publication.listeners.append(self)
        call_later(EARLY_S, self._publish_early)

    def latch(self) -> None:
        """Latch the topic from now on."""
        with self._lock:
            if self._is_latching:
                return
            self._is_latching = True
            before = self._publisher
            self._publisher = self._node.advertise(
                self._topic, self.message_class, queue_size=self._queue_size, latch=True
            )
            before.unregister()

    def publish(self, message: Any) -> None:
        """Publish a message, or queue it until there is a subscriber. The order is kept."""
        with self._lock:
            is_early = self._early or not self._publisher.connection_count
            if is_early and time.monotonic() < self._early_until_s:
                self._early_bytes += sum(map(len, message._to_buffers()))
                if self._early_bytes <= EARLY_BYTES:
                    self._early.append(message)
                    return
            self._flush()
            self._publisher.publish(message)

    def close(self) -> None:
        """Publish the queued messages and unregister the topic."""
        with self._lock:
            self._flush()
            self._publisher.unregister()

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:
        """Schedule publishing of the queued messages after a subscriber has connected."""
        del topic_name, topic_publish, peer_publish
        if time.monotonic() < self._early_until_s:
            self._call_later(GATHERING_S, self._publish_early)

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Do nothing; only new subscribers matter."""

    def _publish_early(self) -> None:
        with self._lock:
            self._flush()

    def _flush(self) -> None:
        self._early_until_s = min(self._early_until_s, time.monotonic())
        early, self._early = self._early, []
        for message in early:
            self._publisher.publish(message)
