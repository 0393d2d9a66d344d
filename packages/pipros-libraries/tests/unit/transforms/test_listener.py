import logging
from typing import Any

import pytest

from pipros.basics.errors import Interrupted
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node.clock import WallClock
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformGate, TransformListener

TransformStamped: Any = load_message_class("geometry_msgs/TransformStamped")
TFMessage: Any = load_message_class("tf2_msgs/TFMessage")


class Node:
    """Keeps the callbacks of subscriptions by topic."""

    def __init__(self) -> None:
        self.limits, self.log, self.clock = process_limits(), logging.Logger("test"), WallClock()
        self.is_ending = False
        self.callbacks: dict[str, Any] = {}

    def subscribe(self, topic: str, _: Any, callback: Any, **__: Any) -> Any:
        self.callbacks[topic] = callback
        return self

    def unregister(self) -> None:
        self.callbacks.clear()

    def send(self, stamp_s: float, x: float, topic: str = "/tf", child: str = "base") -> None:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = "map", at(stamp_s)
        transform.transform.translation.x, transform.transform.rotation.w = x, 1.0
        self.callbacks[topic](TFMessage([transform]))


def at(seconds: float) -> Time:
    return Time(*divmod(round(seconds * NS_PER_S), NS_PER_S))


def message(stamp_s: float, frame: str = "base") -> Any:
    made: Any = load_message_class("sensor_msgs/LaserScan")()
    made.header.stamp, made.header.frame_id = at(stamp_s), frame
    return made


@pytest.fixture
def node() -> Any:
    return Node()


def test_transforms_of_both_topics_are_found(node: Any) -> None:
    listener = TransformListener(node)
    node.send(10, 1.0)
    node.send(11, 3.0)
    node.send(0, 5.0, "/tf_static", "lamp")
    assert listener.at("map", "base", 10 * NS_PER_S)[0] == 1.0
    assert listener.at("map", "base", 10_500_000_000, 1.0)[0] == 2.0
    assert listener.at("map", "lamp", 99 * NS_PER_S)[0] == 5.0
    with pytest.raises(TransformException):
        listener.at("map", "base", 12 * NS_PER_S, 0.001)
    node.is_ending = True
    with pytest.raises(Interrupted):
        listener.at("map", "base", 12 * NS_PER_S, 5.0)
    listener.close()
    assert not node.callbacks


def test_rejected_transforms_are_reported(node: Any) -> None:
    listener, problems = TransformListener(node), []
    listener.problems = problems.append
    node.send(10, float("nan"))
    assert "TF_NAN_INPUT" in problems[0]


def test_messages_wait_for_their_transform(node: Any) -> None:
    listener = TransformListener(node)
    delivered, dropped = [], []
    gate = TransformGate(listener, "/map", 2, delivered.append, dropped.append, tolerance_ns=100_000_000)
    messages = [message(10.0), message(10.5), message(11.0)]
    for each in messages:
        gate.add(each)
    assert dropped == [messages[0]]
    node.send(10, 0)
    assert delivered == []
    node.send(10.6, 0)
    assert delivered == [messages[1]]
    node.send(11.1, 0)
    gate.add(message(10.2, "/base"))
    gate.add(message(10.2, "map"))
    gate.add(message(10.2, ""))
    assert [each.header.frame_id for each in delivered] == ["base", "base", "/base", "map"]


def test_one_transform_from_the_future_is_dropped_and_a_clock_that_is_ahead_is_not(node: Any) -> None:
    listener = TransformListener(node)
    now_s = node.clock.now_ns() / NS_PER_S
    node.send(2**32 - 1, 1.0)
    node.send(now_s, 2.0)
    assert listener.at("map", "base", 0)[0] == 2.0
    node.send(now_s + 3600.0, 3.0)
    assert listener.at("map", "base", 0)[0] == 2.0
    node.send(now_s + 3600.1, 4.0)
    assert listener.at("map", "base", 0)[0] == 4.0
    node.send(now_s, 5.0)  # that clock has been set
    assert listener.at("map", "base", 0)[0] == 5.0
