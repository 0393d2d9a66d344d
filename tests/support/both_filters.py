"""Feed a filter of pipros and the genuine one with the same messages, one by one."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.navigation_oracle import add_to
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")
CLASSES = {
    "odom": "nav_msgs/Odometry",
    "pose": "geometry_msgs/PoseWithCovarianceStamped",
    "twist": "geometry_msgs/TwistWithCovarianceStamped",
    "imu": "sensor_msgs/Imu",
    "cmd_vel": "geometry_msgs/Twist",
    "set_pose": "geometry_msgs/PoseWithCovarianceStamped",
}


class BothFilters:
    """Two filters with the same parameters and inputs; the outputs are in namespaces."""

    def __init__(self, node: Node, processes: list[Process]) -> None:
        self.node = node
        self._processes = processes
        self._changed = threading.Condition()
        self.outputs: dict[str, list[Any]] = {side: [] for side in SIDES}
        self.transforms: dict[str, list[Any]] = {side: [] for side in SIDES}
        self.accelerations: dict[str, list[Any]] = {side: [] for side in SIDES}
        self._publishers: dict[str, Any] = {}
        self._estimates = [
            self._keep(side, "odometry/filtered", "nav_msgs/Odometry", self.outputs) for side in SIDES
        ]
        for side in SIDES:
            self._keep(side, "tf", "tf2_msgs/TFMessage", self.transforms)
            self._keep(side, "accel/filtered", "geometry_msgs/AccelWithCovarianceStamped", self.accelerations)

    def _keep(self, side: str, topic: str, type_name: str, stores: dict[str, list[Any]]) -> Any:
        keep = self._keeper(stores[side])
        return self.node.subscribe(f"/{side}/{topic}", load_message_class(type_name), keep)

    def _keeper(self, store: list[Any]) -> Any:
        def keep(message: Any) -> None:
            with self._changed:
                store.append(message)
                self._changed.notify_all()

        return keep

    def publish(self, topic: str, message: Any, *, subscribers: int = 2) -> None:
        """Publish a message when both filters have subscribed to the topic, and their estimates arrive."""
        if topic not in self._publishers:
            publisher = self.node.advertise(topic, type(message), queue_size=100, latch=topic == "/tf_static")
            self._publishers[topic] = publisher
        publisher = self._publishers[topic]
        wait_until(lambda: publisher.connection_count >= subscribers, 60, f"the filters on {topic}")
        # An estimate is published once: it would be lost on its way to a subscription that is not connected.
        wait_until(lambda: all(each.connection_count for each in self._estimates), 60, "their estimates")
        publisher.publish(message)

    def feed(self, topic: str, message: Any) -> tuple[Any, Any]:
        """Publish a measurement, wait until both filters have published its time; return that."""
        self.publish(topic, message)
        return self.wait_for(message.header.stamp.to_sec())

    def call(self, service: str, type_name: str, *values: Any) -> list[list[Any]]:
        """Call a service of both filters; return the values of each response."""
        service_class: Any = load_service_class(type_name)
        responses = []
        for side in SIDES:
            client = self.node.client(f"/{side}/{service}", service_class)
            response: Any = client.call(service_class._request_class(*values))
            responses.append([getattr(response, name) for name in response.__slots__])
        return responses

    def wait_for(self, stamp_s: float) -> tuple[Any, Any]:
        """Return the first estimates of both sides that are not older."""

        def found(side: str) -> Any:
            estimates = self.outputs[side][-3:]
            return next((e for e in estimates if e.header.stamp.to_sec() >= stamp_s - 1e-5), None)

        with self._changed:
            if not self._changed.wait_for(lambda: all(found(side) for side in SIDES), 30):
                lacking = [side for side in SIDES if not found(side)]
                raise AssertionError(
                    f"no estimate of {lacking} for {stamp_s}: {[p.output for p in self._processes]}"
                )
            first, second = (found(side) for side in SIDES)
        return first, second


@contextmanager
def both_filters(
    ros: RosSystem, program: str, parameters: Mapping[str, Any], *, simulated: bool = False
) -> Iterator[BothFilters]:
    """Run both filters with these parameters. Their frequency is 200 Hz if it is not given."""
    ros.serve_master()
    folder = add_to(ros.genuine)
    node = Node("test", environment=Environment(master_uri=ros.master_uri))
    with node:
        if simulated:
            node.params.set("/use_sim_time", True)
        for side in SIDES:
            given = {"frequency": 200.0, "sensor_timeout": 1e12, **parameters}
            node.params.set(f"/{side}/filter", given)
        commands: dict[str, list[str | Path]] = {
            "pipros": ["rosrun", "robot_localization", program],
            "genuine": [folder / "lib/robot_localization" / program],
        }
        processes = [
            getattr(ros, side).start(
                *commands[side], "__name:=filter", f"__ns:=/{side}", "cmd_vel:=/cmd_vel", f"/tf:=/{side}/tf"
            )
            for side in SIDES
        ]
        yield BothFilters(node, processes)
        for process in processes:
            process.press_ctrl_c()
            process.wait()


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


def stamped(kind: str, stamp_s: float, frame: str = "") -> Any:
    """Return an empty message of an input kind."""
    message: Any = load_message_class(CLASSES[kind])()
    message.header.stamp = Time(*divmod(round(stamp_s * 1e9), 1_000_000_000))
    message.header.frame_id = frame
    return message
