"""The nodelet `yocs_velocity_smoother/VelocitySmootherNodelet`, which limits speed and acceleration."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any, Final

from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.rate import Timer, surviving
from pipros_libraries.nodes.params import InvalidParameter, private, raw
from pipros_libraries.nodes.velocities import VelocityOutput, check_axis, check_settings, checked_rate
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_robot.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother

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
        self._clock, self._log = node.clock, node.log
        self._twist: Any = load_message_class("geometry_msgs/Twist")
        self._lock = threading.Lock()
        rate_hz = checked_rate("~frequency", private(node, "frequency", _RATE_HZ))
        quiet, chosen = raw(node, "quiet", False) is True, raw(node, "robot_feedback", 0)
        if chosen not in list(Feedback):
            node.log.warning("~robot_feedback must be 0 (none), 1 (odometry) or 2 (commands), got %s", chosen)
            chosen = 0
        feedback = Feedback(chosen)

        def log(level: int, text: str) -> None:
            if not (quiet and "measured" in text):
                node.log.log(level, text)

        self._smoother = VelocitySmoother(_LIMITS, 1 / rate_hz, feedback, log)
        self._values: Mapping[str, Value] | None = None
        check_settings(node, "~", SETTINGS)
        self._settings = Reconfigurable(node, "~", SETTINGS, self._apply)
        self._output = VelocityOutput(node, "~smooth_cmd_vel")
        odometry: Any = load_message_class("nav_msgs/Odometry")
        if feedback is Feedback.ODOMETRY:
            node.subscribe("~odometry", odometry, lambda m: self._on_measured(m.twist.twist), queue_size=1)
        elif feedback is Feedback.COMMANDS:
            node.subscribe("~robot_cmd_vel", self._twist, self._on_measured, queue_size=1)
        node.subscribe("~raw_cmd_vel", self._twist, self._on_command, queue_size=1)
        step = surviving(self._step, node.log, self._output.stop)
        self._timer = Timer(self._clock, round(NS_PER_S / rate_hz), lambda _: step(), reset=True)

    def _apply(self, values: Mapping[str, Value], _level: int) -> Mapping[str, Value]:
        v = {name: float(value) for name, value in values.items()}
        limits = VelocityLimits(
            (v["speed_lim_v"], v["speed_lim_w"]), (v["accel_lim_v"], v["accel_lim_w"]), v["decel_factor"]
        )
        try:
            for axis, letter in enumerate("vw"):
                name = f"~speed_lim_{letter}"
                braking = limits.acceleration[axis] * limits.deceleration
                gain = f"~accel_lim_{letter} times ~decel_factor", braking
                check_axis((name, 0.0), (name, limits.speed[axis]), gain)
        except InvalidParameter as error:
            if self._values is None:  # there are no limits to keep, and the defaults may be too fast
                raise
            self._log.error("the limits are not changed: %s", error)
            return self._values
        with self._lock:
            self._smoother.limits = limits
        self._values = values
        return values

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
        """Stop the robot, and stop publishing."""
        self._timer.shutdown()
        self._output.unregister()
