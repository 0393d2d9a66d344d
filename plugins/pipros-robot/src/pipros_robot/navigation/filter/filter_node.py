"""The node for both filters: connects a `Timeline` to topics, services and transforms."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import serve, subscribe
from pipros_libraries.transforms.listener import AHEAD_NS
from pipros_libraries.transforms.messages import in_ns, vector_of
from pipros_libraries.transforms.pose import IDENTITY, Pose
from pipros_robot.navigation.filter.estimates import Estimates
from pipros_robot.navigation.filter.health import Health
from pipros_robot.navigation.filter.kalman import Control
from pipros_robot.navigation.filter.measurements import InputSettings, Readings, seconds
from pipros_robot.navigation.filter.message_values import is_missing, rotational, six, square
from pipros_robot.navigation.filter.settings import KINDS, InputTopic, make_timeline, read_settings
from pipros_robot.navigation.filter.state import (
    POSE,
    RATES,
    SIZE,
    Array,
    Measurement,
    UnusableMeasurement,
    VelocityCommand,
)
from pipros_robot.navigation.plane import MOST

_TYPES: Final = (
    "nav_msgs/Odometry", "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TwistWithCovarianceStamped", "sensor_msgs/Imu",
)  # fmt: skip


class FilterNode:
    """Estimates a robot's state from input topics. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule, *, unscented: bool) -> None:
        """Register the topics and services, and start the cycle.

        Raises:
            InvalidParameter: a parameter has an invalid value.
        """
        parameters, found = read_parameters(node), node.params.search("tf_prefix")
        prefix = node.params.get(found) if found else ""
        self._settings = settings = read_settings(parameters, prefix if isinstance(prefix, str) else "")
        self._timeline = make_timeline(parameters, unscented=unscented)
        for problem in parameters.problems:
            log.error("%s", problem)
        self._node, self._log, self._schedule = node, log, schedule
        self._lock = threading.Lock()
        self._frames = Frames(node, log)
        frames, gravity = (
            (settings.world_frame, settings.base_link_frame),
            settings.gravitational_acceleration,
        )
        self._readings = Readings(*frames, self._find, settings.two_d_mode, gravity)
        self._readings.state = self._timeline.kalman.state
        self._last_stamps: dict[str, int] = {}
        self._pose_set_ns = 0
        self._throttles: dict[str, Throttle] = {}
        self._is_on, self._is_started = True, False
        self._health = Health(node, settings)
        self._estimates = Estimates(node, log, settings, self._frames)
        self._rates: tuple[float, Array] = (0.0, np.zeros(3))
        self._subscribe()
        if settings.disabled_at_startup:
            serve(node, "~enable", "std_srvs/Empty", lambda _: self._start())
        else:
            self._start()

    def _subscribe(self) -> None:
        node, control = self._node, self._timeline.kalman.control
        readers = self._on_odometry, self._on_pose, self._on_twist, self._on_imu
        for topic in self._settings.topics:
            if not topic.is_used:
                self._log.warning("%s uses no variables: its topic is ignored", topic.name)
                continue
            kind = KINDS.index(topic.kind)
            take = partial(self._receive, readers[kind], topic)
            size, nodelay = topic.queue_size, topic.nodelay
            message = load_message_class(_TYPES[kind])
            node.subscribe(topic.topic, message, take, queue_size=size, tcp_nodelay=nodelay)
        subscribe(node, "set_pose", _TYPES[1], self._set_pose)
        service = "robot_localization/SetPose"
        serve(node, "set_pose", service, lambda request: self._set_pose(request.pose))
        serve(node, "~toggle", "robot_localization/ToggleFilterProcessing", self._toggle)
        if control is not None:
            command = f"geometry_msgs/Twist{'Stamped' * self._settings.stamped_control}"
            subscribe(node, "cmd_vel", command, partial(self._on_command, control))

    # -- services ----------------------------------------------------------------

    def _start(self) -> None:
        with self._lock:
            if not self._is_started:
                self._is_started = True
                self._schedule.every(1.0 / self._settings.frequency, self._cycle)

    def _toggle(self, request: Any) -> bool:
        with self._lock:
            if request.on == self._is_on:
                self._log.warning("the filter is already %s", "on" if self._is_on else "off")
                return False
            self._is_on = request.on
        return True

    def _set_pose(self, message: Any) -> None:
        stamp_ns, now_ns = in_ns(message.header.stamp), self._node.clock.now_ns()
        frame, covariance = message.header.frame_id, square(message.pose.covariance, 6)
        whole = InputSettings("set_pose", np.ones(SIZE, bool))
        with self._lock:
            try:
                with np.errstate(all="ignore"):
                    pose = self._posed(message.pose.pose.position, message.pose.pose.orientation)
                    placed = self._readings.pose(whole, frame, stamp_ns, pose, covariance)
            except (UnusableMeasurement, ArithmeticError) as error:
                self._log.error("set_pose: %s", error)
                return
            if placed is None or len(placed.usable()) < SIZE or (now_ns and stamp_ns > now_ns + AHEAD_NS):
                text = "set_pose: the pose is not finite, or in the future, or there is no transform from %s"
                self._log.error(text, frame)
                return
            self._readings.forget()
            self._timeline.clear(None if not self._timeline.has_started else self._now_s())
            self._pose_set_ns = stamp_ns
            kalman = self._timeline.kalman
            kalman.state, kalman.covariance = placed.values, np.eye(SIZE) * 1e-6
            kalman.covariance[POSE, POSE] = placed.covariance[POSE, POSE]

    # -- inputs ------------------------------------------------------------------

    def _find(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        return self._frames.find(target, source.lstrip("/"), stamp_ns, self._settings.transform_timeout)

    def _now_s(self) -> float:
        return seconds(self._node.clock.now_ns())

    def _receive(self, read: Callable[[InputTopic, Any, int], None], topic: InputTopic, message: Any) -> None:
        stamp_ns, now_ns = in_ns(message.header.stamp), self._node.clock.now_ns()
        with self._lock:
            if not self._is_on:
                return
            if stamp_ns <= self._pose_set_ns <= now_ns + AHEAD_NS:  # otherwise, the time has moved back
                self._health.warn(
                    f"{topic.name} stamp", "a message is not newer than the pose set by set_pose"
                )
                return
            if stamp_ns > now_ns + AHEAD_NS and now_ns:
                self._drop(topic.name, "its timestamp is in the future, and would outdate the next ones")
                return
            try:
                with np.errstate(all="ignore"):
                    read(topic, message, stamp_ns)
            except (UnusableMeasurement, ArithmeticError) as error:
                self._drop(topic.name, error)

    def _drop(self, source: str, reason: object) -> None:
        self._throttles.setdefault(source, Throttle(self._log, 5.0)).warning(
            "a message of %s is dropped: %s", source, reason
        )

    def _on_odometry(self, topic: InputTopic, message: Any, stamp_ns: int) -> None:
        child = message.child_frame_id if topic.uses_child_frame else ""
        self._read_pose(topic.pose, message.header.frame_id, message.pose, stamp_ns, child)
        self._read_twist(topic.twist, message.child_frame_id, message.twist, stamp_ns)

    def _on_pose(self, topic: InputTopic, message: Any, stamp_ns: int) -> None:
        self._read_pose(topic.pose, message.header.frame_id, message.pose, stamp_ns)

    def _on_twist(self, topic: InputTopic, message: Any, stamp_ns: int) -> None:
        self._read_twist(topic.twist, message.header.frame_id, message.twist, stamp_ns)

    def _read_pose(
        self, sensor: InputSettings, frame: str, given: Any, stamp_ns: int, child: str = ""
    ) -> None:
        if self._is_expected(sensor, stamp_ns):
            pose = self._posed(given.pose.position, given.pose.orientation)
            covariance = square(given.covariance, 6)
            self._add(self._readings.pose(sensor, frame, stamp_ns, pose, covariance, child))

    def _read_twist(self, sensor: InputSettings, frame: str, given: Any, stamp_ns: int) -> None:
        if self._is_expected(sensor, stamp_ns):
            twist = six(given.twist)
            self._add(self._readings.twist(sensor, frame, stamp_ns, twist, square(given.covariance, 6)))

    def _on_imu(self, topic: InputTopic, message: Any, stamp_ns: int) -> None:
        frame, attitude = message.header.frame_id, None
        if not is_missing(message.orientation_covariance):
            attitude = self._posed(None, message.orientation)
            if self._is_expected(topic.pose, stamp_ns):
                covariance = rotational(message.orientation_covariance)
                self._add(self._readings.attitude(topic.pose, frame, stamp_ns, attitude, covariance))
        rates, forces = message.angular_velocity_covariance, message.linear_acceleration_covariance
        if not is_missing(rates) and self._is_expected(topic.twist, stamp_ns):
            twist = np.array((0.0, 0.0, 0.0, *vector_of(message.angular_velocity)))
            self._add(self._readings.twist(topic.twist, frame, stamp_ns, twist, rotational(rates)))
        sensor = topic.acceleration
        if not is_missing(forces) and self._is_expected(sensor, stamp_ns):
            force = np.array(vector_of(message.linear_acceleration))
            forces = square(forces, 3)
            self._add(self._readings.acceleration(sensor, frame, stamp_ns, force, forces, attitude))

    def _posed(self, position: Any, orientation: Any) -> Pose:
        """Return a pose with the orientation normalized. Warn if its norm differs from 1 by more than 0.01.

        A zero quaternion becomes the identity, without a warning.
        """
        x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
        norm = math.hypot(x, y, z, w)
        place = (0.0, 0.0, 0.0) if position is None else vector_of(position)
        if norm == 0.0:
            return (*place, *IDENTITY[3:])
        if norm > MOST:
            raise UnusableMeasurement(f"the quaternion has the norm {norm:g}")
        if abs(norm - 1.0) > 0.01:
            self._log.warning("an orientation of an input has the norm %.3f: it is normalized", norm)
        return (*place, x / norm, y / norm, z / norm, w / norm)

    def _is_expected(self, sensor: InputSettings, stamp_ns: int) -> bool:
        """Return False if no variables of the input are used, or a later message has already arrived.

        In the second case, reset the filter if `reset_on_time_jump` is set and the time is simulated.
        """
        if not sensor.flags.any():
            return False
        if stamp_ns < self._last_stamps.get(sensor.source, 0):
            if self._settings.reset_on_time_jump and self._node.clock.is_simulated:
                self._reset()
            else:
                self._health.warn(sensor.source, "a message is older than the previous one: it is ignored")
                clock = self._node.clock
                last_ns = self._last_stamps[sensor.source]
                if clock.is_simulated and last_ns > clock.now_ns():
                    self._drop(sensor.source, "the time moved back, and ~reset_on_time_jump is not set")
                elif last_ns > clock.now_ns() + NS_PER_S:  # a computer's clock was set
                    self._drop(sensor.source, "the time moved back: restart the filter")
            return False
        self._last_stamps[sensor.source] = stamp_ns
        return True

    def _reset(self) -> None:
        self._log.warning("the time moved back: the filter restarts")
        self._last_stamps.clear()
        self._readings.forget()
        self._frames.buffer.clear()
        self._pose_set_ns = 0
        self._timeline.reset()
        self._estimates.reset()

    def _add(self, measurement: Measurement | None) -> None:
        if measurement is not None:
            self._health.check(measurement)
            self._timeline.add(measurement)

    def _on_command(self, control: Control, message: Any) -> None:
        with self._lock:
            if not np.all(np.abs(six(message.twist if self._settings.stamped_control else message)) <= MOST):
                self._drop("cmd_vel", f"velocities must be finite, and at most {MOST:g}")
                return
            if not self._settings.stamped_control:
                command = VelocityCommand(six(message), self._now_s())
            elif message.header.frame_id.lstrip("/") in ("", self._settings.base_link_frame):
                command = VelocityCommand(six(message.twist), seconds(in_ns(message.header.stamp)))
            else:
                frames = self._settings.base_link_frame, message.header.frame_id
                self._log.warning("commands must be in the frame %s, got one in %s", *frames)
                return
            control.command = command

    # -- the cycle ---------------------------------------------------------------

    def _cycle(self) -> None:
        now_s = self._now_s()
        with self._lock:
            if self._is_on:
                self._timeline.advance(now_s)
            if self._timeline.is_history_too_short:
                self._log.warning("a measurement is older than the history: history_length is too short")
                self._timeline.is_history_too_short = False
            for source in sorted(self._timeline.failures):
                self._drop(source, "the estimate would no longer be finite")
            self._timeline.failures.clear()
            kalman = self._timeline.kalman
            self._readings.state = kalman.state
            if self._timeline.time_s is None:
                return
            before_s, rates = self._rates
            self._rates = now_s, kalman.state[RATES].copy()
            if now_s > before_s:
                self._readings.angular_acceleration = (self._rates[1] - rates) / (now_s - before_s)
            turning, time_s = self._readings.angular_acceleration, self._timeline.time_s
            if self._estimates.publish(time_s, kalman, turning, now_s - before_s):
                self._health.tick()


def main(name: str) -> int:
    """Run `ekf_localization_node` or `ukf_localization_node`. Return 1 if a parameter is invalid."""
    return run_node(name, "robot_localization", partial(FilterNode, unscented=name.startswith("ukf")))
