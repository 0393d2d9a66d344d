"""Feed a filter of pipros with recorded messages, one by one; compare its estimates with the genuine ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.both_navigation import SIDES, BothNodes, end_node, start_node
from tests.support.processes import Process
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

_CLOCK: Any = load_message_class("rosgraph_msgs/Clock")


class BothFilters(BothNodes):
    """Both filters, and their estimates."""

    def __init__(self, node: Node, process: Process, recording: Recording) -> None:
        super().__init__(node, process, "filter", recording)
        self.estimates = self.inboxes("odometry/filtered", "nav_msgs/Odometry")
        # An estimate is published once: it would be lost on its way to a subscription that is not connected.
        wait_until(lambda: self.subscribers["odometry/filtered"].connection_count, 60, lambda: self.output)

    def set_clock(self, time_s: float) -> None:
        """Publish simulated time, in seconds after the first message."""
        now = Time(*divmod(round((1000.0 + time_s) * 1e9), 1_000_000_000))
        self._publisher("/clock", _CLOCK, 1).publish(_CLOCK(now))

    def publish_next(self, topic: str, *, to: str = "", subscribers: int = 1) -> Any:
        return super().publish_next(topic, to=to, subscribers=subscribers)

    def feed(self, topic: str) -> float:
        """Publish the next measurement; return the difference of the estimates for its time."""
        return self.difference_at(self.publish_next(topic).header.stamp.to_sec())

    def difference_at(self, stamp_s: float) -> float:
        """Wait until pipros has published an estimate for a time; return how far both estimates are apart."""
        return difference(*self.wait_for(stamp_s))

    def wait_for(self, stamp_s: float) -> tuple[Any, Any]:
        """Return the first estimates of both sides that are not older."""

        def found(side: str) -> Any:
            estimates = self.estimates[side].messages
            return next((e for e in estimates if e.header.stamp.to_sec() >= stamp_s - 1e-5), None)

        wait_until(lambda: found("pipros"), 30, lambda: f"an estimate for {stamp_s}: {self.output}", 0.001)
        own, genuine = map(found, SIDES)
        assert genuine, f"no estimate for {stamp_s} is recorded"
        return own, genuine


@contextmanager
def both_filters(
    ros: RosSystem,
    recording: Recording,
    program: str,
    parameters: Mapping[str, Any],
    *,
    simulated: bool = False,
) -> Iterator[BothFilters]:
    """Run the filter with these parameters. Its frequency is 200 Hz if it is not given."""
    ros.serve_master()
    recording.give("parameters", parameters)
    recording.give("simulated time", simulated)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        if simulated:
            node.params.set("/use_sim_time", True)
        node.params.set("/pipros/filter", {"frequency": 200.0, "sensor_timeout": 1e12, **parameters})
        process = start_node(ros, "robot_localization", program, "filter", "cmd_vel:=/cmd_vel")
        yield BothFilters(node, process, recording)
        end_node(process)


def difference(one: Any, other: Any) -> float:
    """Return the greatest difference between two estimates; of variances, relative to 1 at least."""
    largest = 0.0
    for part, kind in (("pose", "pose"), ("twist", "twist")):
        first, second = getattr(one, part), getattr(other, part)
        a, b = np.array(first.covariance), np.array(second.covariance)
        largest = max(largest, float(np.max(np.abs(a - b) / np.maximum(1.0, np.abs(b)))))
        largest = max(
            largest, float(np.max(np.abs(_numbers(getattr(first, kind)) - _numbers(getattr(second, kind)))))
        )
    return max(largest, float(abs(one.header.stamp.to_sec() - other.header.stamp.to_sec())))


def _numbers(message: Any) -> Any:
    """Return all numbers in a message. Quaternions q and -q are the same rotation: w is positive."""
    numbers: list[float] = []
    for name in message.__slots__:
        part = getattr(message, name)
        values = [getattr(part, axis) for axis in part.__slots__]
        numbers += [-value for value in values] if len(values) == 4 and values[3] < 0 else values
    return np.array(numbers)
