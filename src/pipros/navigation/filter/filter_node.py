"""The node of both filters: topics, services and transforms around a `Timeline`."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np

from pipros.libraries.transforms.messages import in_ns, pose_of
from pipros.libraries.transforms.pose import IDENTITY, Pose
from pipros.msg import load_message_class, load_service_class
from pipros.navigation.filter.control import Control
from pipros.navigation.filter.estimates import Estimates
from pipros.navigation.filter.health import Health
from pipros.navigation.filter.measurements import Input, Readings, seconds
from pipros.navigation.filter.settings import Settings, Topic
from pipros.navigation.filter.state import POSE, RATES, SIZE, Array, Command, Measurement
from pipros.navigation.filter.timeline import Timeline
from pipros.navigation.frames import Frames
from pipros.node import Node
from pipros.node.rate import Timer

_CLASSES: Final = {
    "odom": "nav_msgs/Odometry",
    "pose": "geometry_msgs/PoseWithCovarianceStamped",
    "twist": "geometry_msgs/TwistWithCovarianceStamped",
    "imu": "sensor_msgs/Imu",
}


class FilterNode:
    """Estimates a robot's state from its input topics. Callbacks run in several threads, under one lock."""

    def __init__(self, node: Node, log: logging.Logger, settings: Settings, timeline: Timeline) -> None:
        """Register the topics and services, and start the cycle."""
        self._node, self._log, self._settings, self._timeline = node, log, settings, timeline
        self._lock = threading.Lock()
        self._frames = Frames(node, log)
        self._readings = Readings(
            settings.world_frame, settings.base_frame, self._find, settings.in_plane, settings.gravity
        )
        self._readings.state = timeline.kalman.state
        self._last_stamps: dict[str, int] = {}
        self._pose_set_ns = 0
        self._is_on = True
        self._control = timeline.kalman.control
        self._health = Health(node, settings)
        self._estimates = Estimates(node, log, settings, self._frames)
        self._rates: tuple[float, Array] = (0.0, np.zeros(3))
        self._timer: Timer | None = None
        self._subscribe()
        if settings.is_disabled:
            self._serve("~enable", "std_srvs/Empty", self._enable)
        else:
            self._start()

    def _subscribe(self) -> None:
        readers = {
            "odom": self._on_odometry,
            "pose": self._on_pose,
            "twist": self._on_twist,
            "imu": self._on_imu,
        }
        for topic in self._settings.topics:
            if not topic.is_used:
                self._log.warning("%s uses no variables: it is not subscribed to", topic.name)
                continue
            self._node.subscribe(
                topic.topic,
                load_message_class(_CLASSES[topic.kind]),
                partial(self._receive, readers[topic.kind], topic),
                queue_size=topic.queue_size,
                tcp_nodelay=topic.nodelay,
            )
        stamped = load_message_class("geometry_msgs/PoseWithCovarianceStamped")
        self._node.subscribe("set_pose", stamped, self._set_pose, queue_size=1)
        self._serve("set_pose", "robot_localization/SetPose", lambda request: self._set_pose(request.pose))
        self._serve("~toggle", "robot_localization/ToggleFilterProcessing", self._toggle)
        if self._control is not None:
            kind = "TwistStamped" if self._settings.is_command_stamped else "Twist"
            command = load_message_class(f"geometry_msgs/{kind}")
            self._node.subscribe("cmd_vel", command, partial(self._on_command, self._control), queue_size=1)

    def _serve(self, name: str, type_name: str, handle: Callable[[Any], bool | None]) -> None:
        """Offer a service; the result of `handle`, if any, is the only field of the response."""
        service_class = load_service_class(type_name)

        def respond(request: Any) -> Any:
            answer = handle(request)
            return service_class._response_class(*([] if answer is None else [answer]))

        self._node.serve(name, service_class, respond)

    # -- services ----------------------------------------------------------------

    def _start(self) -> None:
        period_ns = round(1e9 / self._settings.frequency)
        self._timer = Timer(self._node.clock, period_ns, lambda _: self._cycle(), reset=True, name="filter")

    def _enable(self, _: Any) -> None:
        with self._lock:
            if self._timer is None:
                self._start()

    def _toggle(self, request: Any) -> bool:
        with self._lock:
            if request.on == self._is_on:
                self._log.warning("the filter is already %s", "on" if self._is_on else "off")
                return False
            self._is_on = request.on
        return True

    def _set_pose(self, message: Any) -> None:
        stamp_ns = in_ns(message.header.stamp)
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        covariance = _square(message.pose.covariance, 6)
        with self._lock:
            self._readings.forget()
            self._timeline.clear(None if not self._timeline.has_started else self._now_s())
            self._pose_set_ns = stamp_ns
            whole = Input("set_pose", np.ones(SIZE, bool))
            placed = self._readings.pose(whole, message.header.frame_id, stamp_ns, pose, covariance)
            if placed is None:
                self._log.error("set_pose: no transform from %s", message.header.frame_id)
                return
            kalman = self._timeline.kalman
            kalman.state, kalman.covariance = placed.values, np.eye(SIZE) * 1e-6
            kalman.covariance[POSE, POSE] = placed.covariance[POSE, POSE]

    # -- inputs ------------------------------------------------------------------

    def _find(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        return self._frames.find(target, source.lstrip("/"), stamp_ns, self._settings.tf_timeout_s)

    def _now_s(self) -> float:
        return seconds(self._node.clock.now_ns())

    def _receive(self, read: Callable[[Topic, Any, int], None], topic: Topic, message: Any) -> None:
        stamp_ns = in_ns(message.header.stamp)
        with self._lock:
            if not self._is_on:
                return
            if stamp_ns <= self._pose_set_ns:
                self._health.warn(f"{topic.name} stamp", "a message is older than the pose that was set")
                return
            read(topic, message, stamp_ns)

    def _on_odometry(self, topic: Topic, message: Any, stamp_ns: int) -> None:
        child = message.child_frame_id if topic.uses_child_frame else ""
        self._read_pose(topic.pose, message.header.frame_id, message.pose, stamp_ns, child)
        self._read_twist(topic.twist, message.child_frame_id, message.twist, stamp_ns)

    def _on_pose(self, topic: Topic, message: Any, stamp_ns: int) -> None:
        self._read_pose(topic.pose, message.header.frame_id, message.pose, stamp_ns)

    def _on_twist(self, topic: Topic, message: Any, stamp_ns: int) -> None:
        self._read_twist(topic.twist, message.header.frame_id, message.twist, stamp_ns)

    def _read_pose(self, sensor: Input, frame: str, given: Any, stamp_ns: int, child: str = "") -> None:
        if self._is_expected(sensor, stamp_ns):
            pose = self._posed(given.pose.position, given.pose.orientation)
            covariance = _square(given.covariance, 6)
            self._add(self._readings.pose(sensor, frame, stamp_ns, pose, covariance, child))

    def _read_twist(self, sensor: Input, frame: str, given: Any, stamp_ns: int) -> None:
        if self._is_expected(sensor, stamp_ns):
            twist = _six(given.twist)
            self._add(self._readings.twist(sensor, frame, stamp_ns, twist, _square(given.covariance, 6)))

    def _on_imu(self, topic: Topic, message: Any, stamp_ns: int) -> None:
        frame = message.header.frame_id
        attitude = None
        if not _is_missing(message.orientation_covariance):
            attitude = self._posed(None, message.orientation)
            if self._is_expected(topic.pose, stamp_ns):
                covariance = np.zeros((6, 6))
                covariance[3:, 3:] = _square(message.orientation_covariance, 3)
                self._add(self._readings.attitude(topic.pose, frame, stamp_ns, attitude, covariance))
        rates = message.angular_velocity_covariance
        if not _is_missing(rates) and self._is_expected(topic.twist, stamp_ns):
            covariance = np.zeros((6, 6))
            covariance[3:, 3:] = _square(rates, 3)
            turning = message.angular_velocity
            twist = np.array([0.0, 0.0, 0.0, turning.x, turning.y, turning.z])
            self._add(self._readings.twist(topic.twist, frame, stamp_ns, twist, covariance))
        uncertainty = message.linear_acceleration_covariance
        if not _is_missing(uncertainty) and self._is_expected(topic.acceleration, stamp_ns):
            pushing = message.linear_acceleration
            acceleration = np.array([pushing.x, pushing.y, pushing.z])
            square = _square(uncertainty, 3)
            sensor = topic.acceleration
            self._add(self._readings.acceleration(sensor, frame, stamp_ns, acceleration, square, attitude))

    def _posed(self, position: Any, orientation: Any) -> Pose:
        """Return a pose with a normalized quaternion; warn if its norm is wrong."""
        x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
        norm = float(np.sqrt(x * x + y * y + z * z + w * w))
        place = (0.0, 0.0, 0.0) if position is None else (position.x, position.y, position.z)
        if norm == 0.0:
            return (*place, *IDENTITY[3:])
        if abs(norm - 1.0) > 0.01:
            self._log.warning("an orientation of an input has the norm %.3f: it is normalized", norm)
        return (*place, x / norm, y / norm, z / norm, w / norm)

    def _is_expected(self, sensor: Input, stamp_ns: int) -> bool:
        """Return False if the input has no variables, or sent a later message before."""
        if not sensor.flags.any():
            return False
        if stamp_ns < self._last_stamps.get(sensor.source, 0):
            if self._settings.resets_on_jump and self._node.clock.is_simulated:
                self._reset()
            else:
                self._health.warn(sensor.source, "a message is older than the previous one: it is ignored")
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
            if not self._settings.is_command_stamped:
                command = Command(_six(message), self._now_s())
            elif message.header.frame_id.lstrip("/") in ("", self._settings.base_frame):
                command = Command(_six(message.twist), seconds(in_ns(message.header.stamp)))
            else:
                self._log.warning(
                    "commands must be in the frame %s, got one in %s",
                    self._settings.base_frame,
                    message.header.frame_id,
                )
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
            kalman = self._timeline.kalman
            self._readings.state = kalman.state
            if self._timeline.time_s is None:
                return
            before_s, rates = self._rates
            self._rates = now_s, kalman.state[RATES].copy()
            if now_s > before_s:
                self._readings.angular_acceleration = (self._rates[1] - rates) / (now_s - before_s)
            if self._estimates.publish(
                self._timeline.time_s, kalman, self._readings.angular_acceleration, now_s - before_s
            ):
                self._health.tick()


def _six(twist: Any) -> Array:
    line, turn = twist.linear, twist.angular
    return np.array([line.x, line.y, line.z, turn.x, turn.y, turn.z])


def _square(values: Any, size: int) -> Array:
    return np.array(values, float).reshape(size, size)


def _is_missing(covariance: Any) -> bool:
    return bool(abs(covariance[0] + 1) < 1e-9)
