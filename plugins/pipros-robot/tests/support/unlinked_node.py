"""Nodes without links, whose callbacks a test calls, and the check that they endure edge values."""

import math
import time
from collections.abc import Callable
from copy import deepcopy
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from tests.support.edge_values import edge_messages

BASE: Final = "base_footprint"


class Cycles:
    """A schedule whose only function a test calls."""

    in_lockstep = False

    def every(self, period_s: float, do: Callable[[], object], failed: Any = None, name: str = "") -> None:
        del period_s, failed, name
        self.cycle = do


class Work:
    """A schedule whose functions are called by `cycle`."""

    in_lockstep = False

    def __init__(self) -> None:
        self._functions: list[Callable[[], object]] = []

    def every(
        self, period_s: float, do: Callable[[], object], failed: Any = None, name: str = ""
    ) -> Callable[[float], None]:
        del period_s, failed, name
        self._functions.append(do)
        return lambda changed_s: None

    def cycle(self) -> None:
        for do in self._functions:
            do()


class UnlinkedNode(Node):
    """A node without links.

    Attributes:
        inputs: the callbacks of its subscribers, by topic.
        sent: the messages of its publishers, by topic.
        loops_back: whether its callbacks receive the messages of its publishers.
        services: the handlers of its services, by the names that are given.
    """

    def __init__(self, name: str, **options: Any) -> None:
        self.inputs: dict[str, list[Callable[[Any], object]]] = {}
        self.sent: dict[str, list[Any]] = {}
        self.loops_back = True
        self.services: dict[str, Callable[[Any], Any]] = {}
        super().__init__(name, **options)

    def subscribe(self, topic: str, message_class: Any, callback: Any, **_: Any) -> Any:  # type: ignore[override]
        self.inputs.setdefault(self.resolve(topic), []).append(callback)
        return SimpleNamespace(unregister=lambda: None, connection_count=1)

    def advertise(self, topic: str, message_class: Any, **_: Any) -> Any:
        name = self.resolve(topic)
        sent = self.sent.setdefault(name, [])

        def publish(message: Any) -> None:
            sent.append(message)
            for callback in self.inputs.get(name, []) if self.loops_back else []:
                callback(deepcopy(message))

        publication = SimpleNamespace(listeners=[], message_class=message_class)
        return SimpleNamespace(publish=publish, connection_count=1, unregister=lambda: None, topic=name,
                               publication=publication)  # fmt: skip

    def serve(self, name: str, service_class: Any, handler: Callable[[Any], Any], **_: Any) -> Any:  # type: ignore[override]
        self.services[name] = handler
        return SimpleNamespace(name=self.resolve(name))

    def give(self, topic: str, message: Any) -> None:
        for callback in self.inputs[topic]:
            callback(message)


def message(kind: str, frame: str = "", **fields: Any) -> Any:
    made: Any = load_message_class(kind)(**fields)
    if hasattr(made, "header"):
        made.header.frame_id, made.header.stamp = frame, now()
    return made


def now(ago_s: float = 0.0) -> Time:
    return Time(*divmod(time.time_ns() - round(ago_s * 1e9), 1_000_000_000))


def transforms(parent: str, child: str, x: float = 0.0, ago_s: float = 0.0) -> Any:
    return plane.transforms(parent, child, plane.raised((x, 0.0, 0.0)), now(ago_s))


def variances(value: float) -> list[float]:
    return [value * (index % 7 == 0) for index in range(36)]


def posed(frame: str, x: float = 1.0) -> Any:
    made = message("geometry_msgs/PoseWithCovarianceStamped", frame)
    made.pose.pose.position.x, made.pose.pose.orientation.w = x, 1.0
    made.pose.covariance = variances(0.01)
    return made


def scan() -> Any:
    """Return a scan in a round room with a radius of 1 m."""
    return message(
        "sensor_msgs/LaserScan", BASE, angle_min=-3.0, angle_max=3.0, angle_increment=0.1, range_min=0.1,
        range_max=5.0, ranges=[1.0] * 61,
    )  # fmt: skip


def odometry(x: float = 1.0) -> Any:
    made = message("nav_msgs/Odometry", "odom", child_frame_id="base_link")
    made.pose.pose.position.x, made.pose.pose.orientation.w = x, 1.0
    made.pose.covariance, made.twist.covariance = variances(0.01), variances(0.01)
    return made


def imu() -> Any:
    made = message("sensor_msgs/Imu", "base_link")
    made.orientation.w, made.linear_acceleration.z = 1.0, 9.8
    for name in ("orientation", "angular_velocity", "linear_acceleration"):
        setattr(made, f"{name}_covariance", [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01])
    return made


def occupancy() -> Any:
    """Return a map of the round room, with the origin at its centre."""
    cells = np.arange(80) * 0.05 - 2.0 + 0.025
    distance = np.hypot(*np.meshgrid(cells, cells))
    made = message("nav_msgs/OccupancyGrid", "map", data=np.where(distance > 1.0, 100, 0).ravel().tolist())
    made.info.width = made.info.height = 80
    made.info.resolution = 0.05
    made.info.origin.position.x = made.info.origin.position.y = -2.0
    made.info.origin.orientation.w = 1.0
    return made


def endures(
    node: UnlinkedNode,
    topic: str,
    good: Callable[[], Any],
    has_effect: Callable[[], bool],
    ago_s: float = 0.0,
) -> None:
    """Give each edge message to a topic. After each, good messages, which `has_effect` gives, have theirs."""
    assert has_effect(), f"{topic}: good messages have no effect"
    failed = []
    for change, edge in edge_messages(good()):
        if hasattr(edge, "header") and "header.stamp" not in change:
            edge.header.stamp = now(ago_s)
        try:
            node.give(topic, edge)
            if not has_effect():
                failed.append(change)
        except Exception as error:
            failed.append(f"{change}: {type(error).__name__}: {error}")
    assert not failed, "\n".join(failed)


def finite(sent: Any) -> bool:
    """Return whether all numbers of a message are finite."""
    if hasattr(sent, "__slots__") and hasattr(sent, "_slot_types"):
        return all(finite(getattr(sent, name)) for name in sent.__slots__)
    if isinstance(sent, list | tuple):
        return all(map(finite, sent))
    return not isinstance(sent, float) or math.isfinite(sent)
