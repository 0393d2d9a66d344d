"""Topics that a gateway passes between ROS 1 and ROS 2; `topic_to_ros1` and `topic_to_ros2` pass them.

The connection header of every topic that a gateway publishes in ROS 1 contains the field `MARK`. Gateways do
not pass messages of such topics to ROS 2, so messages never loop, regardless of the number of gateways.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node.codec import decoder, encoder
from pipros_ros2.interface import ZENOH_MESSAGE_BYTES
from pipros_ros2.qos_choice import QosOverride
from pipros_ros2.rules import StaticRule
from pipros_ros2.type_pairs import TypePair

MARK: Final = "pipros_ros2"
"""Field in the connection header of each topic that a gateway publishes in ROS 1."""
STATIC_TRANSFORMS: Final = "/tf_static"
QUEUE: Final = 1000
KEPT: Final = 100
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


def static_transforms_of(route: Route) -> StaticTransforms | None:
    """Return what merges the messages of a route for `/tf_static`, and None for other routes."""
    is_static = STATIC_TRANSFORMS in (route.ros1, route.ros2)
    if not is_static or route.pair.plan.ros1_type != "tf2_msgs/TFMessage":
        return None
    return StaticTransforms(ZENOH_MESSAGE_BYTES)
