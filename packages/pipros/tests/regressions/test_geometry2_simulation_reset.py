"""geometry2: after a reset of the simulator or a loop of a bag, robots stood where they had been before."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node.clock import SimulatedClock
from pipros_libraries.transforms.listener import TransformListener

TransformStamped: Any = load_message_class("geometry_msgs/TransformStamped")
TFMessage: Any = load_message_class("tf2_msgs/TFMessage")

S = 1_000_000_000


class Robot:
    """A node whose time is simulated, and which receives what `send` sends."""

    def __init__(self) -> None:
        self.limits, self.log, self.clock = process_limits(), logging.Logger("robot"), SimulatedClock()
        self.callbacks: dict[str, Any] = {}
        self.transforms: Any = TransformListener(self)  # type: ignore[arg-type] # all that it uses is here

    def subscribe(self, topic: str, _: Any, callback: Any, **__: Any) -> None:
        self.callbacks[topic] = callback

    def send(self, stamp_s: float, x: float, topic: str = "/tf", child: str = "base") -> None:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = "odom", Time.from_sec(stamp_s)
        transform.transform.translation.x, transform.transform.rotation.w = x, 1.0
        self.callbacks[topic](TFMessage([transform]))

    def x(self, child: str = "base") -> float:
        return float(self.transforms.at("odom", child, 0)[0])


@pytest.mark.parametrize("late", [0, 1, 5])
def test_poses_from_before_a_reset_are_forgotten(late: int) -> None:
    robot = Robot()
    robot.clock.set_ns(100 * S)
    robot.send(0, 7.0, "/tf_static", "laser")
    robot.send(100, 1.0)
    robot.clock.set_ns(2 * S)
    for number in range(late):  # sent before the reset, received after it
        robot.send(99.5 + 0.1 * number, 1.0)
    robot.send(2.1, 2.0)
    assert (robot.x(), robot.x("laser")) == (2.0, 7.0)


def test_a_computer_whose_clock_is_ahead_is_still_heard_after_a_reset() -> None:
    robot = Robot()
    robot.clock.set_ns(100 * S)
    robot.send(100, 1.0)
    robot.clock.set_ns(2 * S)
    for number in range(1, 9):
        robot.send(1000 + number, number)
    assert robot.x() == 8.0
