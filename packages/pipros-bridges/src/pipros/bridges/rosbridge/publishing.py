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
from typing import Any, Final

from pipros.basics.errors import LimitExceeded, PiprosError
from pipros.basics.limits import limit_text
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.rosbridge.filling import Filler
from pipros.bridges.shares import Charge, ClientShares
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.server.act_gate import ActGate

EARLY_S: Final = 1.0
"""Maximum time (s) that the first messages of a publisher wait for a subscriber."""
EARLY_BYTES: Final = 8 * 1024 * 1024
MESSAGE_BYTES: Final = 500
"""Approximate memory for a kept message, besides its content."""
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
        self._limit = node.limits.of(BridgeLimits).bridge_topics
        self._shared: dict[str, _SharedPublisher] = {}
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
        with self._lock:
            found = self._shared.get(topic)
            if found is None:
                self._close_oldest()
                found = self._shared[topic] = _SharedPublisher(
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
            self._gate.left(topic, user)
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
            limit = limit_text("bridge_topics", self._limit)
            raise LimitExceeded(f"too many topics are advertised; {limit}")
        self._shared.pop(min(unused, key=lambda topic: self._shared[topic].unused_since_s)).close()


class _SharedPublisher:
    """A publisher of the node, with messages waiting for its first subscriber."""

    def __init__(
        self,
        node: Node,
        gate: ActGate,
        topic: str,
        message_class: Any,
        latch: bool,
        queue_size: int,
        call_later: CallLater,
    ) -> None:
        self.message_class = message_class
        self.users: dict[Hashable, ClientShares] = {}
        self.unused_since_s = 0.0
        self._node = node
        self._gate = gate
        self._topic = topic
        self._queue_size = max(queue_size, 1)
        self._call_later = call_later
        self._is_latching = latch
        self._publisher = node.advertise(topic, message_class, queue_size=self._queue_size, latch=latch)
        self._early_until_s = time.monotonic() + EARLY_S
        self._early: list[tuple[Any, Charge]] = []
        self._early_bytes = 0
        self._latched: Charge | None = None  # memory of the newest message, if the topic is latched
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

    def publish(self, message: Any, shares: ClientShares, end_parsing: Callable[[], int]) -> None:
        """Publish a message, or queue it until there is a subscriber. Messages stay in order."""
        with self._lock:
            has_to_wait = self._early or not self._publisher.connection_count
            is_early = bool(has_to_wait) and time.monotonic() < self._early_until_s
            if not (is_early or self._is_latching):
                self._flush()
                self._send(message)
                return
            size = sum(map(len, message._to_buffers()))
            cost = max(size, end_parsing()) + MESSAGE_BYTES
            if is_early and self._early_bytes + size <= EARLY_BYTES and shares.messages.take(cost):
                self._early_bytes += size
                self._early.append((message, Charge(shares.messages, cost)))
                return
            self._flush()
            if self._is_latching:
                self._pay_latched(shares, cost)
            self._send(message)

    def pass_charges(self, left: ClientShares) -> bool:
        """Charge another client, or `left_behind`, instead of a client that no longer publishes the topic.

        Return False if too little memory is left in `left_behind`.
        """
        with self._lock:
            charges = [charge for _, charge in self._early]
            charges += [self._latched] if self._latched is not None else []
            heir = next(iter(self.users.values()), None)
            heir_budget = left.left_behind if heir is None else heir.messages
            return all(
                each.pass_to(heir_budget, is_forced=heir is not None)
                for each in charges
                if each.budget is left.messages
            )

    def close(self) -> None:
        """Publish the queued messages and unregister the topic."""
        with self._lock:
            self._flush()
            self._publisher.unregister()
            if self._latched is not None:
                self._latched.end()
                self._latched = None

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:
        """Schedule publishing of the queued messages after a subscriber has connected."""
        del topic_name, topic_publish, peer_publish
        if time.monotonic() < self._early_until_s:
            self._call_later(GATHERING_S, self._publish_early)

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Do nothing; only new subscribers matter."""

    def _send(self, message: Any) -> None:
        self._publisher.publish(message)
        self._gate.renew_after_publishing(self._topic, message)

    def _publish_early(self) -> None:
        with self._lock:
            self._flush()

    def _flush(self) -> None:
        self._early_until_s = min(self._early_until_s, time.monotonic())
        early, self._early, self._early_bytes = self._early, [], 0
        for message, charge in early:
            self._send(message)
            unused: Charge | None = charge
            if self._is_latching:
                unused, self._latched = self._latched, charge
            if unused is not None:
                unused.end()

    def _pay_latched(self, shares: ClientShares, cost: int) -> None:
        """Charge the client that sent the newest latched message, instead of the previous client."""
        before = self._latched
        if before is not None and before.budget is shares.messages:
            is_paid = before.change(cost)
        else:
            is_paid = shares.messages.take(cost)
            if is_paid:
                self._latched = Charge(shares.messages, cost)
                if before is not None:
                    before.end()
        if not is_paid:
            raise LimitExceeded(
                f"the latched messages of this client need too much memory; "
                f"{limit_text('bridge_parsed_bytes', int(shares.messages.limit))}"
            )
