"""Subscribe to several topics, and receive their messages in sets with matching timestamps."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

from pipros.basics.intervals import ClockWatch
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.subscriber import Subscriber
from pipros_libraries.filters.synchronizer import ApproximateSynchronizer, ExactSynchronizer

APPROXIMATE_S: Final = 0.1
"""Maximum difference between the timestamps of matching messages, if they need not be equal."""

Subscribe = Callable[[Node, str, Callable[[Any], object], int], Subscriber[Any]]
"""Subscribes to a topic: the node, the topic, the callback and the queue size."""


class SyncInput(NamedTuple):
    """A synchronized input. `subscribe` replaces the subscription, for example for compressed images."""

    topic: str
    type: str
    subscribe: Subscribe | None = None


def synchronized(
    node: Node,
    inputs: Sequence[SyncInput],
    callback: Callable[..., object],
    queue_size: int,
    *,
    is_exact: bool = True,
    topic_queue_size: int | None = None,
) -> list[Subscriber[Any]]:
    """Subscribe, and call `callback` with matching messages, one from each input. Return the subscriptions.

    If the node's clock moves back, the messages that wait for others are dropped.

    Args:
        queue_size: maximum number of messages per input that wait for matching messages.
        is_exact: whether matching timestamps must be equal; otherwise, they must differ by less than
            `APPROXIMATE_S`.
        topic_queue_size: the queue size of the subscriptions; defaults to `queue_size`.
    """
    size = max(queue_size, 1)
    matcher: ExactSynchronizer = ExactSynchronizer(len(inputs), size)
    if not is_exact:
        matcher = ApproximateSynchronizer(len(inputs), size, round(APPROXIMATE_S * NS_PER_S))
    lock, watch = threading.Lock(), ClockWatch()

    def receive(index: int, message: Any) -> None:
        stamp = message.header.stamp
        with lock:
            if watch.has_gone_back(node.clock.now_ns()):  # new messages would be dropped as the oldest
                for queue in matcher.queues:
                    queue.clear()
            queue = matcher.queues[index]
            for complete in matcher.add(message, stamp.to_nsec(), queue, index, None):
                callback(*complete)

    subscriptions = []
    for index, each in enumerate(inputs):

        def on_message(message: Any, index: int = index) -> None:
            receive(index, message)

        subscribe = each.subscribe or partial(_subscribe, kind=each.type)
        subscriptions.append(subscribe(node, each.topic, on_message, topic_queue_size or size))
    return subscriptions


def _subscribe(
    node: Node, topic: str, callback: Callable[[Any], object], queue_size: int, kind: str
) -> Subscriber[Any]:
    message_class = load_message_class(kind)
    return node.subscribe(topic, message_class, callback, queue_size=queue_size, zero_copy=True)


def inside(node: Node, namespace: str, name: str) -> str:
    """Resolve a topic name in a namespace; `/name` stays absolute. Both can be remapped."""
    return node.resolve(name if name.startswith("/") else f"{node.resolve(namespace)}/{name}")
