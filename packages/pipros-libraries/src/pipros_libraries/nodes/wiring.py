"""Create a node's topics, services and messages from the names of their types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node

__all__ = ["advertise", "serve", "stamped", "subscribe", "time_of"]


def advertise(node: Node, topic: str, kind: str, queue_size: int | None = 1, *, latch: bool = False) -> Any:
    """Advertise a topic with the type named `kind`."""
    return node.advertise(topic, load_message_class(kind), queue_size=queue_size, latch=latch)


def subscribe(node: Node, topic: str, kind: str, take: Callable[[Any], object], queue_size: int = 1) -> Any:
    """Subscribe to a topic with the type named `kind`."""
    return node.subscribe(topic, load_message_class(kind), take, queue_size=queue_size)


def serve(node: Node, name: str, kind: str, handle: Callable[[Any], Any]) -> None:
    """Offer a service. `handle` returns the response's only field, a tuple of its fields, or None."""
    service: Any = load_service_class(kind)

    def respond(request: Any) -> Any:
        answer = handle(request)
        fields = answer if isinstance(answer, tuple) else () if answer is None else (answer,)
        return service._response_class(*fields)

    node.serve(name, service, respond)


def stamped(kind: str, frame: str, stamp: Time | int, **fields: Any) -> Any:
    """Return a message with a header. `stamp` may be a time in ns."""
    message: Any = load_message_class(kind)(**fields)
    message.header.frame_id = frame
    message.header.stamp = time_of(stamp) if isinstance(stamp, int) else stamp
    return message


def time_of(stamp_ns: int) -> Time:
    return Time(*divmod(max(0, stamp_ns), NS_PER_S))
