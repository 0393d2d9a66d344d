"""Publishes on `/statistics` what a node's subscriptions measure; see `pipros.node.traffic`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time
from pipros.node.clock import NS_PER_S
from pipros.node.publisher import Publisher
from pipros.node.traffic import TrafficMeter, Window, WindowLimits

#: Topics that nobody measures: measuring them would bring about more of the same.
UNMEASURED = ("/statistics", "/clock")


class StatisticsPublisher:
    """Measures every link of a node's subscriptions, once `Node.enable_statistics` was called."""

    def __init__(
        self,
        node_name: str,
        advertise: Callable[..., Publisher[Any]],
        now_ns: Callable[[], int],
        limits: WindowLimits,
    ) -> None:
        self._node_name = node_name
        self._now_ns = now_ns
        self._limits = limits
        self._meters: dict[tuple[str, str], TrafficMeter] = {}
        self._lock = threading.Lock()
        self._class: Any = load_message_class("rosgraph_msgs/TopicStatistics")
        self._publisher = advertise("/statistics", self._class, queue_size=10)

    def arrived(self, topic: str, header: Mapping[str, str], size: int, message: Any) -> None:
        """Takes over an arrival, in the thread of its link."""
        if topic in UNMEASURED:
            return
        publisher = header.get("callerid", "?")
        sequence = stamp_ns = None
        if getattr(message, "_has_header", False):
            sequence, stamp_ns = message.header.seq, message.header.stamp.to_nsec()
        with self._lock:
            meter = self._meters.setdefault((topic, publisher), TrafficMeter(self._limits))
            window = meter.add(self._now_ns(), size, sequence, stamp_ns)
        if window is not None:
            self._publisher.publish(self._message(topic, publisher, window))

    def _message(self, topic: str, publisher: str, window: Window) -> Any:
        return self._class(
            topic=topic,
            node_pub=publisher,
            node_sub=self._node_name,
            window_start=_time(window.start_ns),
            window_stop=_time(window.stop_ns),
            delivered_msgs=window.delivered,
            dropped_msgs=window.dropped,
            traffic=window.bytes,
            period_mean=Duration.from_sec(window.period_mean_s),
            period_stddev=Duration.from_sec(window.period_stddev_s),
            period_max=Duration.from_sec(window.period_max_s),
            stamp_age_mean=Duration.from_sec(window.age_mean_s),
            stamp_age_stddev=Duration.from_sec(window.age_stddev_s),
            stamp_age_max=Duration.from_sec(window.age_max_s),
        )


def _time(nanoseconds: int) -> Time:
    return Time(*divmod(nanoseconds, NS_PER_S))
