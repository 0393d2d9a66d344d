"""Choose the quality of service that a gateway offers to ROS 2 and requests from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pipros_ros2.interface import Durability, Endpoint, Reliability, TopicQos

LEAST_DEPTH = 10
"""Minimum depth of publishers, except on `/clock` and latched topics, and default depth of best_effort and of
transient_local subscribers. This is the default depth in ROS 2.
"""
RELIABLE_DEPTH = 1000
"""Default depth of reliable volatile subscribers, so that bursts arrive: DDS does not announce the depth of a
publisher. `ROS2_INBOX_BYTES` limits the memory.
"""

_STATIC_TRANSFORMS = "/tf_static"
_CLOCK = "/clock"


@dataclass(frozen=True, slots=True)
class QosOverride:
    """The policies that a rule sets for a topic; None leaves the choice to the gateway."""

    reliability: Reliability | None = None
    durability: Durability | None = None
    depth: int | None = None

    def applied_to(self, qos: TopicQos) -> TopicQos:
        return TopicQos(
            self.reliability or qos.reliability,
            self.durability or qos.durability,
            qos.depth if self.depth is None else self.depth,
        )


@dataclass(frozen=True, slots=True)
class ReaderChoice:
    """A subscriber to create, and the publishers whose messages it passes on.

    A subscriber may also match publishers whose messages another subscriber passes on.
    """

    qos: TopicQos
    publishers: frozenset[bytes]


def offered_qos(
    topic: str, *, is_latched: bool, queue_size: int = 0, override: QosOverride | None = None
) -> TopicQos:
    """Return the QoS of the ROS 2 publisher for a ROS 1 topic.

    By default, it is reliable and volatile, as in ROS 2. It is transient_local for latched topics, with one
    message for each ROS 1 publisher, and for `/tf_static`, whose transforms the gateway merges. It is
    best_effort for `/clock`. The policies in `override` take precedence.
    """
    if topic == _CLOCK:
        qos = TopicQos(Reliability.BEST_EFFORT, Durability.VOLATILE, 1)
    elif is_latched or topic == _STATIC_TRANSFORMS:
        qos = TopicQos(Reliability.RELIABLE, Durability.TRANSIENT_LOCAL, 1)
    else:
        qos = TopicQos(depth=max(LEAST_DEPTH, queue_size))
    return qos if override is None else override.applied_to(qos)


def requested_qos(
    publishers: Sequence[Endpoint], *, override: QosOverride | None = None
) -> tuple[ReaderChoice, ...]:
    """Return the subscribers that together receive from all publishers of a ROS 2 topic.

    There is one subscriber for each durability, because a transient_local subscriber does not match volatile
    publishers. Each subscriber has the strongest policies that match all its publishers: it is reliable if
    all its publishers are reliable.
    """
    latched = [each for each in publishers if each.qos.durability is Durability.TRANSIENT_LOCAL]
    volatile = [each for each in publishers if each.qos.durability is Durability.VOLATILE]
    choices = []
    for group, durability in ((latched, Durability.TRANSIENT_LOCAL), (volatile, Durability.VOLATILE)):
        if not group:
            continue
        is_reliable = all(each.qos.reliability is Reliability.RELIABLE for each in group)
        reliability = Reliability.RELIABLE if is_reliable else Reliability.BEST_EFFORT
        is_lossless = is_reliable and durability is Durability.VOLATILE
        qos = TopicQos(reliability, durability, RELIABLE_DEPTH if is_lossless else LEAST_DEPTH)
        keys = frozenset(each.key for each in group)
        choices.append(ReaderChoice(qos if override is None else override.applied_to(qos), keys))
    return tuple(choices)
