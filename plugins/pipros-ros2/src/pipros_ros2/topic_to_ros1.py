"""A topic of ROS 2 that is published in ROS 1."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.codec import decoder
from pipros.node.publisher import Publisher
from pipros_ros2.bridged_topics import KEPT, MARK, QUEUE, RateLimit, Route, static_transforms_of
from pipros_ros2.counts import Counts
from pipros_ros2.interface import (
    ROS2_HISTORY_BYTES,
    Durability,
    Endpoint,
    Ros2Engine,
    Ros2Subscription,
    Sample,
    TopicQos,
)
from pipros_ros2.qos_choice import requested_qos


class Known(Protocol):
    """Function that returns the ROS 2 publisher whose `Endpoint.key` is `key`.

    It returns None if the publisher's messages must not be passed.
    """

    def __call__(self, key: bytes) -> Endpoint | None: ...


class TopicToRos1:
    """Passes a ROS 2 topic to ROS 1.

    Latched messages are always received in ROS 2, and others only while ROS 1 has subscribers.
    """

    def __init__(
        self,
        node: Node,
        engine: Ros2Engine,
        route: Route,
        identity: str,
        known: Known,
        on_change: Callable[[], object],
    ) -> None:
        """Advertise the topic in ROS 1. Blocks until the master answers.

        Args:
            on_change: called in any thread when ROS 1 subscribers connect or disconnect. Must not block.

        Raises:
            PiprosError: this node publishes the topic with another type.
        """
        self.route = route
        self.counts = Counts()
        self._node = node
        self._engine = engine
        self._known = known
        self._on_change = on_change
        self._pace = RateLimit(route.rate)
        self._merge = static_transforms_of(route)
        self._readers: dict[Durability, tuple[TopicQos, Ros2Subscription]] = {}
        self._lock = threading.Lock()
        self._latched: dict[bytes, tuple[Any, int]] = {}
        self._latched_bytes = 0
        self._absent: set[bytes] = set()
        self._newest: Any = None
        self._headers = {MARK: identity}
        existing = node.endpoints.publication(route.ros1)
        self._class: Any = route.pair.raw if existing is None else existing.message_class
        self._decode = decoder(self._class)
        self._publishers: list[Publisher[Any]] = [self._advertise(latch=False)]
        self._publishers[0].publication.listeners.append(self)

    def _advertise(self, *, latch: bool) -> Publisher[Any]:
        return self._node.endpoints.advertise(
            self.route.ros1, self._class, queue_size=QUEUE, latch=latch, headers=self._headers
        )

    @property
    def types(self) -> tuple[str, str]:
        return self.route.types

    @property
    def is_active(self) -> bool:
        return bool(self._readers)

    @property
    def _is_wanted(self) -> bool:
        links = self._publishers[0].publication.links
        return any(link.caller_id != self._node.name for link in links)

    def update(self, publishers: Sequence[Endpoint]) -> None:
        """Count dropped messages, and create and close subscribers in ROS 2 to match the publishers."""
        for durability, (_, reader) in self._readers.items():
            self.counts.overflow(durability, reader.dropped, f"{self.route.ros2}: the gateway is too slow")
        durability_of = {each.key: each.qos.durability for each in publishers}
        with self._lock:
            absent = self._latched.keys() - durability_of.keys()
            for key in absent & self._absent:  # a publisher that is absent only once may be new
                self._forget(key)
            self._absent = absent
        desired: dict[Durability, TopicQos] = {}
        is_wanted = self._is_wanted
        for choice in requested_qos(publishers, override=self.route.override):
            durability = durability_of[next(iter(choice.publishers))]
            if is_wanted or durability is Durability.TRANSIENT_LOCAL:
                desired[durability] = choice.qos
        for durability, (qos, reader) in list(self._readers.items()):
            if desired.get(durability) != qos:
                del self._readers[durability]
                reader.close()
        for durability, qos in desired.items():
            if durability not in self._readers:
                self._readers[durability] = qos, self._subscribe(durability, qos)

    def _subscribe(self, durability: Durability, qos: TopicQos) -> Ros2Subscription:
        plan = self.route.pair.plan
        return self._engine.subscribe(
            self.route.ros2,
            plan.ros2_type,
            self.route.pair.type_hash,
            qos,
            lambda sample: self._on_sample(durability, sample),
        )

    def _on_sample(self, durability: Durability, sample: Sample) -> None:
        publisher = self._known(sample.publisher)
        if publisher is None or publisher.qos.durability is not durability or not self._pace.admits():
            return
        try:
            body = self.route.pair.plan.to_ros1(sample.payload)
            if self._merge is not None:
                body = self._merge.merged(body)
            self._publish(publisher, body)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self.route.ros2}: {error}")
        else:
            self.counts.passed += 1

    def _publish(self, publisher: Endpoint, body: bytes) -> None:
        message = self._decode(body)
        if publisher.qos.durability is Durability.TRANSIENT_LOCAL:
            if len(self._publishers) == 1:
                self._publishers.append(self._advertise(latch=True))
            if self._merge is None:
                self._keep(publisher.key, message, len(body))
            self._newest = message
        self._publishers[0].publish(message)

    def _keep(self, publisher: bytes, message: Any, size: int) -> None:
        with self._lock:
            self._forget(publisher)
            has_space = self._latched_bytes + size <= ROS2_HISTORY_BYTES
            if has_space and len(self._latched) < KEPT:
                self._latched_bytes += size
                self._latched[publisher] = message, size

    def _forget(self, publisher: bytes) -> None:
        """Remove a publisher's last message. The caller holds the lock."""
        self._latched_bytes -= self._latched.pop(publisher, (None, 0))[1]

    def close(self) -> None:
        """Stop publishing the topic in ROS 1, and close its subscribers in ROS 2."""
        for _, reader in self._readers.values():
            reader.close()
        self._readers.clear()
        for publisher in self._publishers:
            publisher.unregister()

    # -- ROS 1 subscribers that connect or disconnect; see `pipros.node.peers.PeerListener`

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """Send the last message of each latching publisher, except the newest, which was already sent."""
        del topic_name, topic_publish
        with self._lock:
            latched = list(self._latched.values())
        for message, _ in latched:
            if message is not self._newest:
                peer_publish(message)
        self._on_change()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        del topic_name, num_peers
        self._on_change()
