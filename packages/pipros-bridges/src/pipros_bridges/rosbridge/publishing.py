"""Topics that clients publish. For each topic, the node has one publisher, which all clients share.

A publisher is kept for a while after its last client has left, because pages are reloaded. Messages that a
client publishes right after `advertise` wait until a subscriber has connected, for at most `EARLY_S`.

These messages, and the latched message of each topic, count against the memory of the client that published
them. When this client stops publishing the topic, they count against another client of the topic or, without
another client, against `left_behind`; if too little is left there, the publisher is not kept.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from typing import Any

from pipros.basics.errors import LimitExceeded, PiprosError
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_bridges.rosbridge.filling import Filler
from pipros_bridges.rosbridge.shared_publisher import CallLater, SharedPublisher
from pipros_bridges.shared_topics import check_published_type
from pipros_bridges.shares import BRIDGE_TOPICS, ClientShares
from pipros_server.act_gate import ActGate

TypeOf = Callable[[str], str | None]


class UnknownTopic(PiprosError):
    """A client publishes on a topic whose type is unknown."""


class SharedPublishers:
    """The publishers of all clients. Methods may be called from any thread, and may block."""

    def __init__(
        self,
        node: Node,
        filler: Filler,
        type_of: TypeOf,
        call_later: CallLater,
        unregister_s: float,
        gate: ActGate,
    ) -> None:
        """Create an empty set. `unregister_s` is how long (s) a publisher without clients is kept."""
        self._node = node
        self._filler = filler
        self._type_of = type_of
        self._call_later = call_later
        self._unregister_s = unregister_s
        self._gate = gate
        self._limit = BRIDGE_TOPICS
        self._shared: dict[str, SharedPublisher] = {}
        self._lock = threading.Lock()

    def advertise(
        self,
        user: Hashable,
        topic: str,
        kind: str,
        *,
        latch: bool,
        queue_size: int,
        shares: ClientShares,
    ) -> None:
        """Advertise a topic (a global name) for a client. Kept messages count against the client's shares.

        Raises:
            ActRefused: the policy does not allow the topic.
            PiprosError: the type is unknown or differs from the topic's type, or there are too many topics.
        """
        message_class = load_message_class(kind)
        self._gate.check_topic(topic, message_class._type, message_class._md5sum, latch=latch)
        if topic not in self._shared:
            check_published_type(self._node, topic, message_class._type)
        with self._lock:
            found = self._shared.get(topic)
            if found is None:
                self._close_oldest()
                found = self._shared[topic] = SharedPublisher(
                    self._node, self._gate, topic, message_class, latch, queue_size, self._call_later
                )
            elif found.message_class._type != message_class._type:
                raise PiprosError(f"{topic} is already advertised with the type {found.message_class._type}")
            found.users[user] = shares
        if latch:
            found.latch()

    def publish(
        self,
        user: Hashable,
        topic: str,
        values: Any,
        *,
        latch: bool | None,
        queue_size: int,
        shares: ClientShares,
        end_parsing: Callable[[], int],
    ) -> None:
        """Publish a message. If necessary, advertise its topic first, with the type registered at the master.

        `end_parsing` gives back the memory that is counted for the parsed values, and returns its size. It is
        called if the message is kept, because the kept message then counts instead.

        Raises:
            LimitExceeded: the client has no memory left for another latched message, which is not published.
            ActRefused: the policy does not allow the message.
            PiprosError: a value does not fit its field, or the topic cannot be advertised; see `advertise`.
        """
        found = self._shared.get(topic)
        if found is None or user not in found.users:
            kind = found.message_class._type if found is not None else self._type_of(topic)
            if kind is None:
                raise UnknownTopic(f"the type of {topic} is unknown; advertise it before publishing")
            self.advertise(user, topic, kind, latch=bool(latch), queue_size=queue_size, shares=shares)
            found = self._shared[topic]
        message = found.message_class()
        self._filler.fill(message, values)
        if latch:
            self._gate.check_topic(topic, message._type, message._md5sum, latch=True)
        self._gate.check_message(topic, message, client=user)
        if latch:
            found.latch()
        found.publish(message, shares, end_parsing)

    def release(self, user: Hashable, topic: str) -> None:
        """Remove a client from the users of a publisher.

        A publisher without users is unregistered after `unregister_s`, or at once if too little memory is
        left for its messages.
        """
        with self._lock:
            found = self._shared.get(topic)
            if found is None or user not in found.users:
                return
            shares = found.users.pop(user)
            if not self._gate.left(topic, user):
                found.left(shares)
            is_kept = found.pass_charges(shares)
            if found.users:
                return
            found.unused_since_s = time.monotonic()
            if not is_kept:
                del self._shared[topic]
        if is_kept:
            self._call_later(self._unregister_s, lambda: self._unregister_unused(topic))
        else:
            found.close()

    def _unregister_unused(self, topic: str) -> None:
        with self._lock:
            found = self._shared.get(topic)
            overdue_s = time.monotonic() - self._unregister_s
            if found is None or found.users or found.unused_since_s > overdue_s:
                return
            del self._shared[topic]
        found.close()

    def _close_oldest(self) -> None:
        """If there are too many publishers, unregister the one that has been unused for the longest time.

        Raises:
            LimitExceeded: all publishers are in use.
        """
        if len(self._shared) < self._limit:
            return
        unused = [topic for topic, shared in self._shared.items() if not shared.users]
        if not unused:
            limit = f"the limit is {self._limit}"
            raise LimitExceeded(f"too many topics are advertised; {limit}")
        self._shared.pop(min(unused, key=lambda topic: self._shared[topic].unused_since_s)).close()
