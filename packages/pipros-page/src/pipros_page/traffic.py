"""The rate and bandwidth of each topic: the same numbers in all views."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pipros_page.topic_watch import TopicWatch
from pipros_tools.graph.observer import GraphObservation

STATIC_TOPIC = "/tf_static"


@dataclass(frozen=True, slots=True)
class TopicTraffic:
    """The messages and bytes per second that are published on a topic; None while unknown.

    Attributes:
        is_latched: whether the newest message is kept for new subscribers, so that no rate is expected.
    """

    rate: float | None = None
    bandwidth: float | None = None
    is_latched: bool = False


def topic_traffic(
    observation: GraphObservation, watches: Iterable[TopicWatch] = ()
) -> Mapping[str, TopicTraffic]:
    """Return the traffic of the topics for which it is known.

    The page's own measurement is used for the topics to which it subscribes. For others, each publisher
    counts once, with its fastest connection, however many subscribers it has.
    """
    sent: dict[str, dict[str, tuple[float, float]]] = {}
    for connection, traffic in observation.connections.items():
        if traffic is not None:
            publishers = sent.setdefault(connection.topic, {})
            rate, bandwidth = publishers.get(connection.publisher, (0.0, 0.0))
            publishers[connection.publisher] = max(rate, traffic.rate), max(bandwidth, traffic.bandwidth)
    found = {}
    for topic, publishers in sent.items():
        rate, bandwidth = map(sum, zip(*publishers.values(), strict=True))
        found[topic] = TopicTraffic(rate, bandwidth, topic == STATIC_TOPIC)
    for watch in watches:
        figures, known = watch.figures(), found.get(watch.topic, TopicTraffic())
        is_latched = watch.is_latched or watch.topic == STATIC_TOPIC
        if figures["rate"] is not None:
            found[watch.topic] = TopicTraffic(figures["rate"], figures["bandwidth"], is_latched)
        elif watch.topic in found or is_latched:
            found[watch.topic] = TopicTraffic(known.rate, known.bandwidth, is_latched)
    return found
