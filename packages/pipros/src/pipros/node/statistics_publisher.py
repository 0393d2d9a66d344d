"""Publish a node's topic statistics on `/statistics`; see `pipros.node.topic_statistics`."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Duration, Time
from pipros.node.publisher import Publisher
from pipros.node.topic_statistics import StatisticsWindow, TrafficMeter, WindowLimits

UNMEASURED = ("/statistics", "/clock")
"""Topics that are not measured, as in genuine nodes."""

_INT32_MAX = 2**31 - 1
"""Maximum value of a field. Larger values, which peers can cause by their timestamps and sequence numbers,
are reduced to this value.
"""


class StatisticsPublisher:
    """Measures the links of a node's subscriptions, and publishes the results."""

    def __init__(
        self,
        node_name: str,
        advertise: Callable[..., Publisher[Any]],
        now_ns: Callable[[], int],
        limits: WindowLimits,
        max_links: int,
    ) -> None:
        self._node_name = node_name
        self._now_ns = now_ns
        self._limits = limits
        # least recently active first
        self._meters: OrderedDict[tuple[str, str], TrafficMeter] = OrderedDict()
        self._max_links = max_links
        self._lock = threading.Lock()
        self._class: Any = load_message_class("rosgraph_msgs/TopicStatistics")
        self._publisher = advertise("/statistics", self._class, queue_size=10)

    def arrived(self, topic: str, header: Mapping[str, str], size: int, message: Any) -> None:
        """Count a received message. Called in the thread that received the message."""
        if topic in UNMEASURED:
            return
        publisher = header.get("callerid", "?")
        sequence = stamp_ns = None
        if getattr(message, "_has_header", False):
            sequence, stamp_ns = message.header.seq, message.header.stamp.to_nsec()
        with self._lock:
            meter = self._meters.setdefault((topic, publisher), TrafficMeter(self._limits))
            self._meters.move_to_end((topic, publisher))
            if len(self._meters) > self._max_links:
                self._meters.popitem(last=False)
            window = meter.add(self._now_ns(), size, sequence, stamp_ns)
        if window is not None:
            self._publisher.publish(self._message(topic, publisher, window))

    def _message(self, topic: str, publisher: str, window: StatisticsWindow) -> Any:
        return self._class(
            topic=topic,
            node_pub=publisher,
            node_sub=self._node_name,
            window_start=_time(window.start_ns),
            window_stop=_time(window.stop_ns),
            delivered_msgs=min(window.delivered, _INT32_MAX),
            dropped_msgs=min(window.dropped, _INT32_MAX),
            traffic=min(window.bytes, _INT32_MAX),
            period_mean=_duration(window.period_mean_s),
            period_stddev=_duration(window.period_stddev_s),
            period_max=_duration(window.period_max_s),
            stamp_age_mean=_duration(window.age_mean_s),
            stamp_age_stddev=_duration(window.age_stddev_s),
            stamp_age_max=_duration(window.age_max_s),
        )


def _time(nanoseconds: int) -> Time:
    return Time(*divmod(nanoseconds, NS_PER_S))


def _duration(seconds: float) -> Duration:
    return Duration.from_sec(max(-_INT32_MAX, min(seconds, _INT32_MAX)))
