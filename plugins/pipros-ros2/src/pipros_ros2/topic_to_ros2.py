"""A topic of ROS 1 that is published in ROS 2."""

from __future__ import annotations

import threading
from collections.abc import Iterable

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.subscriber import Subscriber
from pipros_ros2.bridged_topics import KEPT, MARK, QUEUE, RateLimit, Route, static_transforms_of
from pipros_ros2.counts import Counts
from pipros_ros2.interface import Durability, Ros2Engine, Ros2Publisher
from pipros_ros2.qos_choice import offered_qos


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
        self._merge = static_transforms_of(route)
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
                self.route.ros1, self.route.pair.raw, self._on_message, queue_size=QUEUE
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

        If messages are latched, each node has its own publisher, up to `KEPT`. Merged static transforms have
        a single publisher.
        """
        with self._lock:
            first = self._publishers[""]
            if not self._is_latched or self._merge is not None or self._first in ("", caller):
                self._first = caller
                return first
            found = self._publishers.get(caller)
            if found is None:
                if len(self._publishers) >= KEPT:
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
