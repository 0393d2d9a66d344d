"""The nodelet `kobuki_safety_controller/SafetyControllerNodelet`: stops the robot, or backs away."""

from __future__ import annotations

import math
import threading
from collections.abc import Collection
from functools import partial
from typing import Any, Final

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.rate import Timer
from pipros.node.subscriber import Subscriber
from pipros_libraries.nodes.params import number
from pipros_libraries.nodes.velocities import VelocityOutput
from pipros_robot.navigation.velocities.velocity_smoother import STOPPED, Velocity

PERIOD_NS: Final = NS_PER_S // 10
QUEUE_SIZE: Final = 10
WHEEL_DROP: Final = "wheel_drop"
LEFT, CENTER, RIGHT = range(3)
_EVENTS: Final = {
    "bumper": ("kobuki_msgs/BumperEvent", "bumper", 3),
    "cliff": ("kobuki_msgs/CliffEvent", "sensor", 3),
    WHEEL_DROP: ("kobuki_msgs/WheelDropEvent", "wheel", 2),
}
"""Kinds of events: the type of the messages, the field that numbers the sensors, and how many there are."""

_ESCAPES: Final[dict[int, Velocity]] = {CENTER: (-0.1, 0.0), LEFT: (-0.1, -0.4), RIGHT: (-0.1, 0.4)}
"""Velocities that lead away from an obstacle or a cliff; the first that applies is used."""


def escape(active: Collection[tuple[str, int]]) -> Velocity | None:
    """Return the velocity (m/s, rad/s) that active sensors require, or None.

    Args:
        active: kinds of events and sensors.
    """
    if any(kind == WHEEL_DROP for kind, _ in active):
        return STOPPED
    sides = {side for _, side in active}
    return next((velocity for side, velocity in _ESCAPES.items() if side in sides), None)


class SafetyNode:
    """Publishes `~cmd_vel` periodically while a bumper, cliff or wheel drop sensor is active.

    A change of a sensor is answered immediately.
    """

    def __init__(self, node: Node) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        self._clock, self._log, self._lock = node.clock, node.log, threading.Lock()
        self._twist: Any = load_message_class("geometry_msgs/Twist")
        self._extension_s = number(node, "time_to_extend_bump_cliff_events", 0.0)
        self._active: set[tuple[str, int]] = set()
        self._is_enabled, self._last, self._event_s = True, STOPPED, -math.inf
        self._output = VelocityOutput(node, "~cmd_vel", queue_size=QUEUE_SIZE)
        self._events: dict[str, Subscriber[Any]] = {}
        empty: Any = load_message_class("std_msgs/Empty")
        for name, take in (
            ("enable", partial(self._enable, True)),
            ("disable", partial(self._enable, False)),
            ("reset", self._reset),
        ):
            node.subscribe(f"~{name}", empty, take, queue_size=QUEUE_SIZE)
        for kind, (type_name, _, _) in _EVENTS.items():
            message_class: Any = load_message_class(type_name)
            take_event = partial(self._on_event, kind)
            topic = f"~events/{kind}"
            self._events[kind] = node.subscribe(topic, message_class, take_event, queue_size=QUEUE_SIZE)
        self._timer = Timer(node.clock, PERIOD_NS, lambda _: self._step(), reset=True)

    def _on_event(self, kind: str, message: Any) -> None:
        _, field, sensors = _EVENTS[kind]
        sensor = getattr(message, field)
        if sensor >= sensors:
            return
        with self._lock:
            if message.state == 1:
                self._active.add((kind, sensor))
                if kind != WHEEL_DROP:
                    self._event_s = self._now_s()
            else:
                self._active.discard((kind, sensor))
        self._step()

    def _enable(self, is_enabled: bool, _: Any) -> None:
        with self._lock:
            self._log.info("%s", "enabled" if is_enabled else "disabled")
            self._is_enabled = is_enabled

    def _reset(self, _: Any) -> None:
        with self._lock:
            self._log.warning("the states of all sensors are reset")
            self._active.clear()

    def _step(self) -> None:
        with self._lock:
            for kind in {kind for kind, _ in self._active}:
                if not self._events[kind].connection_count:  # the base's driver has ended
                    self._active = {each for each in self._active if each[0] != kind}
            velocity = escape(self._active)
            if velocity is not None:
                self._last = velocity
            elif not 0 <= self._now_s() - self._event_s < self._extension_s:
                self._output.stop()
                return
            if self._is_enabled:
                twist = self._twist()
                twist.linear.x, twist.angular.z = self._last
                self._output.publish(twist)
            else:
                self._output.stop()

    def _now_s(self) -> float:
        return self._clock.now_ns() / NS_PER_S

    def close(self) -> None:
        """Stop the robot, and stop publishing."""
        self._timer.shutdown()
        self._output.unregister()
