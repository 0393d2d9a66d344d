"""The nodelet `yocs_velocity_smoother/VelocitySmootherNodelet`, which limits speed and acceleration."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any, Final

from pipros.libraries.nodes.params import number, raw
from pipros.libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother
from pipros.node import Node
from pipros.node.rate import Timer, surviving

_LIMITS: Final = VelocityLimits()
SETTINGS: Final = (
    Setting("speed_lim_v", _LIMITS.speed[0], 0, 10, "maximum forward speed, m/s"),
    Setting("accel_lim_v", _LIMITS.acceleration[0], 0, 10, "maximum forward acceleration, m/s2"),
    Setting("speed_lim_w", _LIMITS.speed[1], 0, 10, "maximum angular speed, rad/s"),
    Setting("accel_lim_w", _LIMITS.acceleration[1], 0, 10, "maximum angular acceleration, rad/s2"),
    Setting("decel_factor", _LIMITS.deceleration, 0, 10, "deceleration as a multiple of the acceleration"),
)
_RATE_HZ = 20.0


class SmootherNode:
    """Publishes `~smooth_cmd_vel` periodically, while commands arrive on `~raw_cmd_vel`."""

    def __init__(self, node: Node) -> None:
        self._clock = node.clock
        self._twist: Any = load_message_class("geometry_msgs/Twist")
        self._lock = threading.Lock()
        rate_hz = number(node, "frequency", _RATE_HZ)
        if rate_hz <= 0:
            raise ValueError(f"~frequency must be > 0, got {rate_hz}")
        quiet, chosen = raw(node, "quiet", False) is True, raw(node, "robot_feedback", 0)
        if chosen not in list(Feedback):
            node.log.warning("~robot_feedback must be 0 (none), 1 (odometry) or 2 (commands), got %s", chosen)
            chosen = 0
        feedback = Feedback(chosen)

        def log(level: int, text: str) -> None:
            if not (quiet and "measured" in text):
                node.log.log(level, text)

        self._smoother = VelocitySmoother(_LIMITS, 1 / rate_hz, feedback, log)
        self._settings = Reconfigurable(node, "~", SETTINGS, self._apply)
        self._output = node.advertise("~smooth_cmd_vel", self._twist, queue_size=1)
        odometry: Any = load_message_class("nav_msgs/Odometry")
        if feedback is Feedback.ODOMETRY:
            node.subscribe("~odometry", odometry, lambda m: self._on_measured(m.twist.twist), queue_size=1)
        elif feedback is Feedback.COMMANDS:
            node.subscribe("~robot_cmd_vel", self._twist, self._on_measured, queue_size=1)
        node.subscribe("~raw_cmd_vel", self._twist, self._on_command, queue_size=1)
        step = surviving(self._step, node.log, lambda: self._output.publish(self._twist()))
        self._timer = Timer(self._clock, round(NS_PER_S / rate_hz), lambda _: step(), reset=True)

    def _apply(self, values: Mapping[str, Value], _level: int) -> None:
        v = {name: float(value) for name, value in values.items()}
        limits = VelocityLimits(
            (v["speed_lim_v"], v["speed_lim_w"]), (v["accel_lim_v"], v["accel_lim_w"]), v["decel_factor"]
        )
        with self._lock:
            self._smoother.limits = limits

    def _on_command(self, message: Any) -> None:
        with self._lock:
            self._smoother.command((message.linear.x, message.angular.z), self._now_s())

    def _on_measured(self, message: Any) -> None:
        with self._lock:
            self._smoother.measured((message.linear.x, message.angular.z))

    def _step(self) -> None:
        with self._lock:
            velocity = self._smoother.step(self._now_s())
        if velocity is not None:
            twist = self._twist()
            twist.linear.x, twist.angular.z = velocity
            self._output.publish(twist)

    def _now_s(self) -> float:
        return self._clock.now_ns() / NS_PER_S

    def close(self) -> None:
        """Stop publishing."""
        self._timer.shutdown()
