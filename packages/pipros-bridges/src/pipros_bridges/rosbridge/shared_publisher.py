"""The publisher of one topic, which all clients share."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from typing import Any, Final

from pipros.basics.errors import LimitExceeded
from pipros.node import Node
from pipros_bridges.shares import Charge, ClientShares
from pipros_libraries.nodes.velocities import RelayedVelocity
from pipros_server.act_gate import ActGate

EARLY_S: Final = 1.0
"""Maximum time (s) that the first messages of a publisher wait for a subscriber."""
EARLY_BYTES: Final = 8 * 1024 * 1024
MESSAGE_BYTES: Final = 500
"""Approximate memory for a kept message, besides its content."""
GATHERING_S: Final = 0.1
"""Time (s) that the first messages wait for more subscribers after the first one has connected."""
CallLater = Callable[[float, Callable[[], object]], object]
"""Calls a function in another thread after a delay in seconds. The function may block."""


class SharedPublisher:
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
        self._velocity = RelayedVelocity(node, self._publisher)
        self._sender: ClientShares | None = None  # of the last message
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
            self._velocity.publisher = self._publisher
            before.unregister()

    def publish(self, message: Any, shares: ClientShares, end_parsing: Callable[[], int]) -> None:
        """Publish a message, or queue it until there is a subscriber. Messages stay in order."""
        with self._lock:
            self._sender = shares
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

    def left(self, shares: ClientShares) -> None:
        """Stop the base if its last velocity is from the client with these shares, which has gone."""
        with self._lock:
            if self._sender is shares:
                self._flush()
                self._velocity.end()

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
        self._velocity.note(message)
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
                f"the limit is {int(shares.messages.limit)} bytes"
            )
