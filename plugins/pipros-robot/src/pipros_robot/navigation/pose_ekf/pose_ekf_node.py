"""The node `robot_pose_ekf`, with the parameters, topics and service of that package."""

from __future__ import annotations

import logging
import math
import threading
from functools import partial
from typing import Any, Final

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, stamped, subscribe
from pipros_libraries.transforms.listener import AHEAD_NS
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import IDENTITY, Pose, composed, inverted
from pipros_robot.navigation import plane
from pipros_robot.navigation.filter.estimates import in_time
from pipros_robot.navigation.filter.measurements import seconds
from pipros_robot.navigation.filter.message_values import rotational, square
from pipros_robot.navigation.filter.state import POSE, Array
from pipros_robot.navigation.plane import MOST
from pipros_robot.navigation.pose_ekf.fusion import Fusion

TOPICS: Final = {"odom": "odom", "imu": "imu_data", "vo": "vo", "gps": "gps"}
QUEUE_SIZE: Final = 10


class PoseEkfNode:
    """Publishes `~odom_combined` and a transform. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register the topics and the service, and start the cycle.

        Raises:
            InvalidParameter: `~freq` or `~sensor_timeout` is not > 0 and finite.
        """
        given = read_parameters(node)
        rate, timeout_s = given.number("freq", 30.0), given.number("sensor_timeout", 1.0)
        for name, value in (("freq", rate), ("sensor_timeout", timeout_s)):
            if not 0 < value < math.inf:
                raise InvalidParameter(f"~{name} must be > 0 and finite, got {value}")
        self._frame = given.text("output_frame", "odom_combined").lstrip("/")
        self._base = given.text("base_footprint_frame", "base_footprint").lstrip("/")
        used = [name for name in TOPICS if given.boolean(f"{name}_used", name != "gps")]
        self._node, self._log, self._lock = node, Throttle(log, 5.0), threading.Lock()
        self._fusion, self._timeout_s = Fusion(used, timeout_s), timeout_s
        self._frames = Frames(node, log)
        self._poses = advertise(node, "~odom_combined", "geometry_msgs/PoseWithCovarianceStamped", QUEUE_SIZE)
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100)
        for name in used:
            if name == "imu":
                subscribe(node, TOPICS[name], "sensor_msgs/Imu", self._on_imu, QUEUE_SIZE)
            else:
                take = partial(self._on_odometry, name)
                subscribe(node, TOPICS[name], "nav_msgs/Odometry", take, QUEUE_SIZE)
        serve(node, "~get_status", "robot_pose_ekf/GetStatus", lambda _: self._status())
        schedule.every(1.0 / rate, self._cycle)

    def _on_odometry(self, name: str, message: Any) -> None:
        """Take a pose. As in the genuine node, its frames have no meaning."""
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        self._take(name, message, pose, square(message.pose.covariance, 6))

    def _on_imu(self, message: Any) -> None:
        frame, stamp_ns = message.header.frame_id.lstrip("/"), in_ns(message.header.stamp)
        mounting = IDENTITY if not frame else self._frames.find(self._base, frame, stamp_ns)
        if mounting is None:
            mounting = IDENTITY if frame == self._base else None
        if mounting is None:
            return
        turn = message.orientation
        pose = (0.0, 0.0, 0.0, turn.x, turn.y, turn.z, turn.w)
        covariance = rotational(message.orientation_covariance)
        self._take("imu", message, pose, covariance, inverted((0.0, 0.0, 0.0, *mounting[3:])))

    def _take(self, name: str, message: Any, pose: Pose, covariance: Array, to_base: Pose = IDENTITY) -> None:
        """Add a pose of a sensor, unless it would spoil the estimate."""
        stamp_ns, now_ns = in_ns(message.header.stamp), self._node.clock.now_ns()
        norm = math.hypot(*pose[3:])
        if not (0.5 < norm < 2.0 and max(map(abs, pose[:3])) <= MOST):
            self._drop(name, f"the pose is invalid: {pose}")
        elif not np.all(np.abs(covariance) <= MOST**2):
            self._drop(name, "the covariance is not finite, or too large")
        elif stamp_ns > now_ns + AHEAD_NS and now_ns:
            self._drop(name, "its timestamp is in the future, and would outdate the next ones")
        else:
            x, y, z, w = (each / norm for each in pose[3:])
            found = composed((*pose[:3], x, y, z, w), to_base)
            with self._lock:
                if not self._fusion.sensors[name].add(seconds(stamp_ns), found, covariance):
                    self._drop(name, "it is not newer than the previous one")

    def _drop(self, name: str, reason: str) -> None:
        self._log.warning("a message of %s is dropped: %s", name, reason)

    def _cycle(self) -> None:
        now_s = seconds(self._node.clock.now_ns())
        with self._lock:
            newest_s = max((each.newest_s for each in self._fusion.sensors.values()), default=-math.inf)
            if newest_s > now_s + AHEAD_NS / 1e9:
                self._log.warning("the time moved back: the filter restarts")
                self._fusion = Fusion([*self._fusion.sensors], self._timeout_s)
            time_s = self._fusion.time_s if self._fusion.step(now_s) else None
            pose, covariance = self._fusion.pose, self._fusion.kalman.covariance[POSE, POSE].ravel().tolist()
        if time_s is None:
            return
        stamp = in_time(time_s)
        message = stamped("geometry_msgs/PoseWithCovarianceStamped", self._frame, stamp)
        plane.fill(message.pose.pose.position, message.pose.pose.orientation, pose)
        message.pose.covariance = covariance
        self._poses.publish(message)
        self._tf.publish(plane.transforms(self._frame, self._base, pose, stamp))

    def _status(self) -> str:
        with self._lock:
            lines, sensors = ["inputs:"], self._fusion.sensors
            for name, topic in TOPICS.items():
                state = f"{sensors[name].received} messages" if name in sensors else "not used"
                lines.append(f"  {name} ({self._node.resolve(topic)}): {state}")
            is_running = self._fusion.time_s is not None
        lines.append(f"filter: {'running' if is_running else 'waits for the first measurements'}")
        return "\n".join(lines)


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("robot_pose_ekf", "robot_pose_ekf", PoseEkfNode)
