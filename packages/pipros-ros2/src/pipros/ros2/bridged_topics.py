"""Topics that a gateway passes between ROS 1 and ROS 2, with one class for each direction.

The connection header of every topic that a gateway publishes in ROS 1 contains the field `MARK`. Gateways do
not pass messages of such topics to ROS 2, so messages never loop, regardless of the number of gateways.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.codec import decoder, encoder
from pipros.node.publisher import Publisher
from pipros.node.subscriber import Subscriber
from pipros.ros2.counts import Counts
from pipros.ros2.interface import (
    Durability,
    Endpoint,
    Ros2Engine,
    Ros2Publisher,
    Ros2Subscription,
    Sample,
    TopicQos,
)
from pipros.ros2.limits import Ros2Limits
from pipros.ros2.qos_choice import QosOverride, offered_qos, requested_qos
from pipros.ros2.rules import StaticRule
from pipros.ros2.type_pairs import TypePair

MARK: Final = "pipros_ros2"
"""Field in the connection header of each topic that a gateway publishes in ROS 1."""
STATIC_TRANSFORMS: Final = "/tf_static"
_QUEUE: Final = 1000
_KEPT: Final = 100
"""Maximum number of latching publishers per topic whose last message is kept for late subscribers."""


class RateLimit:
    """Limits a topic to `rate` messages per second."""

    def __init__(self, rate: float) -> None:
        self._interval_s = 0.0 if math.isinf(rate) else 1 / rate
        self._next_s = -math.inf

    def admits(self) -> bool:
        if not self._interval_s:
            return True
        now_s = time.monotonic()
        if now_s < self._next_s:
            return False
        is_late = now_s - self._next_s > self._interval_s  # a pause does not permit a burst
        self._next_s = (now_s if is_late else self._next_s) + self._interval_s
        return True


class StaticTransforms:
    """Merges `/tf_static` messages into one that contains the newest transform of each child frame.

    This is necessary because a latched topic keeps one message per publisher, and the gateway is a single
    publisher.
    """

    def __init__(self, limit_bytes: int) -> None:
        self._class: Any = load_message_class("tf2_msgs/TFMessage")
        self._limit_bytes = limit_bytes
        self._newest: dict[str, Any] = {}
        self._lock = threading.Lock()

    def merged(self, body: bytes) -> bytes:
        """Add the transforms of a ROS 1 message, and return a message with all transforms.

        Raises:
            PiprosError: the message is malformed, or the merged message exceeds the limit. In the latter
                case, all transforms are forgotten.
        """
        with self._lock:
            for transform in decoder(self._class)(body).transforms:
                self._newest[transform.child_frame_id] = transform
            merged = b"".join(encoder(self._class)(self._class(list(self._newest.values()))))
            if len(merged) > self._limit_bytes:
                self._newest.clear()
                raise PiprosError(f"{STATIC_TRANSFORMS}: the transforms exceed {self._limit_bytes} bytes")
            return merged


@dataclass(frozen=True, slots=True)
class Route:
    """The names and types of a topic that is passed in one direction."""

    ros1: str
    ros2: str
    pair: TypePair
    rate: float = math.inf
    override: QosOverride | None = None

    @property
    def types(self) -> tuple[str, str]:
        """The types in ROS 1 and ROS 2."""
        return self.pair.plan.ros1_type, self.pair.plan.ros2_type


def route_of(ros1: str, ros2: str, pair: TypePair, rule: StaticRule | None) -> Route:
    """Return the route of a topic.

    Raises:
        PiprosError: the rule requires another type.
    """
    if rule is None:
        return Route(ros1, ros2, pair)
    for given, found in ((rule.ros1_type, pair.plan.ros1_type), (rule.ros2_type, pair.plan.ros2_type)):
        if given and given != found:
            raise PiprosError(f"the rule requires the type {given}, got {found}")
    return Route(ros1, ros2, pair, rule.rate, rule.qos)


class TopicToRos2:
    """Passes a ROS 1 topic to ROS 2.

    Latched messages are always received in ROS 1, and others only while ROS 2 has subscribers.
    """

    def __init__(self, node: Node, engine: Ros2Engine, route: Route, *, is_latched: bool) -> None:
        """Advertise the topic in ROS 2.

        Raises:
            PiprosError: the engine is closed, or the name is not legal in ROS 2.
        """
        self.route = route
        self.counts = Counts()
        self._node = node
        self._engine = engine
        self._qos = offered_qos(route.ros1, is_latched=is_latched, override=route.override)
        self._is_latched = self._qos.durability is Durability.TRANSIENT_LOCAL
        self._pace = RateLimit(route.rate)
        self._merge = _merge(node, route)
        self._subscriber: Subscriber[AnyMsg] | None = None
        self._lock = threading.Lock()
        self._publishers: dict[str, Ros2Publisher] = {"": self._advertise()}
        self._first = ""
        self._publishing: frozenset[str] = frozenset()

    def _advertise(self) -> Ros2Publisher:
        pair = self.route.pair
        return self._engine.advertise(self.route.ros2, pair.plan.ros2_type, pair.type_hash, self._qos)

    @property
    def types(self) -> tuple[str, str]:
        return self.route.types

    @property
    def is_active(self) -> bool:
        return self._subscriber is not None

    def update(self, publishers: Iterable[str]) -> None:
        """Count dropped messages, forget absent publishers, and subscribe or unsubscribe in ROS 1.

        May block until the master answers.

        Args:
            publishers: the nodes that publish the topic.
        """
        self._count()
        now = frozenset(publishers)
        self._forget(self._publishing - now)  # keep nodes that were never listed: they may be new
        self._publishing = now
        is_wanted = self._is_latched or any(each.subscriber_count for each in list(self._publishers.values()))
        if is_wanted and self._subscriber is None:
            self._subscriber = self._node.subscribe(
                self.route.ros1, self.route.pair.raw, self._on_message, queue_size=_QUEUE
            )
        elif not is_wanted and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def _count(self) -> None:
        if self._subscriber is not None:
            total = self._subscriber.statistics()["dropped"]
            self.counts.overflow("", total, f"{self.route.ros1}: the gateway is too slow")
        for caller, each in self._publishers.copy().items():  # a copy, because callbacks add publishers
            reason = f"{self.route.ros2}: a ROS 2 subscriber is too slow"
            self.counts.overflow(("to", caller), each.dropped, reason)

    def _on_message(self, raw: AnyMsg) -> None:
        caller = raw.header.get("callerid", "")
        if MARK in raw.header or caller == self._node.name or not self._pace.admits():
            return
        try:
            body = raw.body if self._merge is None else self._merge.merged(raw.body)
            cdr = self.route.pair.plan.to_cdr(body)
            self._publisher_for(caller).publish(cdr)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self.route.ros1}: {error}")
        else:
            self.counts.passed += 1

    def _publisher_for(self, caller: str) -> Ros2Publisher:
        """Return the ROS 2 publisher for a node.

        If messages are latched, each node has its own publisher, up to `_KEPT`. Merged static transforms have
        a single publisher.
        """
        with self._lock:
            first = self._publishers[""]
            if not self._is_latched or self._merge is not None or self._first in ("", caller):
                self._first = caller
                return first
            found = self._publishers.get(caller)
            if found is None:
                if len(self._publishers) >= _KEPT:
                    return first
                found = self._publishers[caller] = self._advertise()
            return found

    def _forget(self, callers: Iterable[str]) -> None:
        """Withdraw the latched messages of nodes that no longer publish the topic."""
        with self._lock:
            ended = [self._publishers.pop(each) for each in callers if each in self._publishers]
        for each in ended:
            each.close()

    def close(self) -> None:
        """Stop publishing the topic in ROS 2, and unsubscribe from it in ROS 1."""
        if self._subscriber is not None:
            self._subscriber.unregister()
        for each in list(self._publishers.values()):
            each.close()


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
        self._merge = _merge(node, route)
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
            self.route.ros1, self._class, queue_size=_QUEUE, latch=latch, headers=self._headers
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
            has_space = self._latched_bytes + size <= self._node.limits.of(Ros2Limits).ros2_history_bytes
            if has_space and len(self._latched) < _KEPT:
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

    # -- ROS 1 subscribers that connect or disconnect; see `pipros.node.publisher.PeerListener`

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


def _merge(node: Node, route: Route) -> StaticTransforms | None:
    is_static = STATIC_TRANSFORMS in (route.ros1, route.ros2)
    if not is_static or route.pair.plan.ros1_type != "tf2_msgs/TFMessage":
        return None
    return StaticTransforms(node.limits.of(Ros2Limits).zenoh_message_bytes)
