"""The node laser_scan_matcher_node, with the parameters and topics of laser_scan_matcher."""

from __future__ import annotations

import logging
import math
import threading
from typing import Any, Final

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import IDENTITY, Pose, rotation_matrix
from pipros_robot.navigation import plane
from pipros_robot.navigation.laser_matcher.icp import IcpSettings, ScanTracker, between
from pipros_robot.navigation.mapping.matching import Places
from pipros_robot.navigation.plane import MOST, Triple
from pipros_robot.perception.clouds.points import InvalidCloud, positions, rows_of
from pipros_robot.perception.laser.projection import projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

_LEAST_POINTS: Final = 10
_MOST_POINTS: Final = 2048
"""Maximum number of points that are matched; each is compared with each point of the previous scan."""
_LONGEST_S: Final = 1.0
"""Maximum time for which a velocity predicts the motion."""
_FORMS: Final = {
    "pose2D": ("geometry_msgs/Pose2D", "publish_pose", True),
    "pose_stamped": ("geometry_msgs/PoseStamped", "publish_pose_stamped", False),
    "pose_with_covariance": ("geometry_msgs/PoseWithCovariance", "publish_pose_with_covariance", False),
    "pose_with_covariance_stamped": (
        "geometry_msgs/PoseWithCovarianceStamped", "publish_pose_with_covariance_stamped", False,
    ),
}  # fmt: skip
"""The types of the topics with the pose, and the parameters that switch them on, with their defaults."""


class LaserMatcherNode:
    """Publishes the pose of the robot. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register the topics.

        Raises:
            InvalidParameter: a covariance is not a list of three numbers, or a limit is not >= 0.
        """
        del schedule  # each scan is processed when it arrives
        given = read_parameters(node)
        self._settings = settings = given.read(IcpSettings)
        for name in ("max_correspondence_dist", "outliers_maxPerc", "outliers_adaptive_order", "sigma"):
            if not 0 <= getattr(settings, name) < math.inf:
                raise InvalidParameter(f"~{name} must be >= 0 and finite, got {getattr(settings, name)}")
        self._fixed = given.text("fixed_frame", "world").lstrip("/")
        self._base = given.text("base_frame", "base_link").lstrip("/")
        small = (1e-9,) * 3
        variances = given.numbers("position_covariance", 3, small)
        self._variances = (*variances, *given.numbers("orientation_covariance", 3, small))
        self._cloud = tuple(
            given.number(f"cloud_{name}", default)
            for name, default in (("range_min", 0.1), ("range_max", 50.0), ("res", 0.05))
        )
        self._log, self._lock, self._frames = Throttle(log, 5.0), threading.Lock(), Frames(node, log)
        self._tracker = ScanTracker(settings)
        self._mounting: Pose | None = None
        self._odometry: tuple[Triple | None, Triple | None] = None, None
        self._yaws: tuple[float | None, float | None] = None, None
        self._velocity, self._stamp_ns = (0.0, 0.0, 0.0), 0
        self._poses = {
            topic: advertise(node, topic, kind, 5)
            for topic, (kind, parameter, default) in _FORMS.items()
            if given.boolean(parameter, default)
        }
        is_sending = given.boolean("publish_tf", True)
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100) if is_sending else None
        if given.boolean("use_imu", True):
            subscribe(node, "imu/data", "sensor_msgs/Imu", self._on_imu)
        if given.boolean("use_odom", True):
            subscribe(node, "odom", "nav_msgs/Odometry", self._on_odometry)
        if given.boolean("use_vel", False):
            is_stamped = given.boolean("stamped_vel", False)
            kind = "geometry_msgs/TwistStamped" if is_stamped else "geometry_msgs/Twist"
            subscribe(node, "vel", kind, self._on_velocity)
        if given.boolean("use_cloud_input", False):
            subscribe(node, "cloud", "sensor_msgs/PointCloud2", self._on_cloud)
        else:
            subscribe(node, "scan", "sensor_msgs/LaserScan", self._on_scan)

    # -- the expected motion -----------------------------------------------------

    def _on_imu(self, message: Any) -> None:
        turn = message.orientation
        pose = (0.0, 0.0, 0.0, turn.x, turn.y, turn.z, turn.w)
        if plane.is_measured(pose):
            with self._lock:
                self._yaws = self._yaws[0], plane.flat(pose)[2]

    def _on_odometry(self, message: Any) -> None:
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        if plane.is_measured(pose):
            with self._lock:
                self._odometry = self._odometry[0], plane.flat(pose)

    def _on_velocity(self, message: Any) -> None:
        twist = getattr(message, "twist", message)
        rates = twist.linear.x, twist.linear.y, twist.angular.z
        if all(abs(each) <= MOST for each in rates):
            self._velocity = rates

    def _expected(self, time_s: float) -> Triple:
        """Return the expected motion since the last scan: that of the wheels, or by the velocity.

        An IMU measures the turn best.
        """
        moved = tuple(each * min(max(time_s, 0.0), _LONGEST_S) for each in self._velocity)
        (old, new), (old_yaw, new_yaw) = self._odometry, self._yaws
        if old is not None and new is not None:
            moved = between(old, new)
        x, y, turn = moved
        if old_yaw is not None and new_yaw is not None:
            turn = math.remainder(new_yaw - old_yaw, math.tau)
        self._odometry, self._yaws = (new, new), (new_yaw, new_yaw)
        return x, y, turn

    # -- scans -------------------------------------------------------------------

    def _on_scan(self, message: Any) -> None:
        scan = Scan.of(message)
        with np.errstate(all="ignore"):
            points = projected(scan, valid_beams(scan)).astype(float)
        self._take(message.header, points)

    def _on_cloud(self, message: Any) -> None:
        """Match the points of a cloud, of which each cell keeps one, in the order of their bearings."""
        least, most, size = self._cloud
        with np.errstate(all="ignore"):
            try:
                points = positions(message, rows_of(message)).astype(float)
            except InvalidCloud as error:
                self._log.warning("a cloud is dropped: %s", error)
                return
            distance = np.hypot(points[:, 0], points[:, 1])
            points = points[(distance >= least) & (distance <= most)]
        if size > 0:
            _, kept = np.unique(np.floor(points[:, :2] / size), axis=0, return_index=True)
            points = points[kept]
        self._take(message.header, points[np.arctan2(points[:, 1], points[:, 0]).argsort()])

    def _take(self, header: Any, points: Any) -> None:
        """Match points in the sensor's frame, shape (n, 3), and publish the pose."""
        frame, stamp_ns = header.frame_id.lstrip("/"), in_ns(header.stamp)
        points = points[np.isfinite(points).all(axis=1) & (np.abs(points) < MOST).all(axis=1)]
        points = plane.thinned(points, _MOST_POINTS)
        if len(points) < _LEAST_POINTS:
            self._log.warning("a scan is dropped: it has %d valid points", len(points))
            return
        mounting = self._mounting or self._find_mounting(frame)
        if mounting is None:
            return
        with self._lock:
            time_s = (stamp_ns - self._stamp_ns) / NS_PER_S if self._stamp_ns else 0.0
            if self._stamp_ns - NS_PER_S < stamp_ns <= self._stamp_ns:
                self._log.warning("a scan is dropped: it is not newer than the previous one")
                return
            self._stamp_ns = stamp_ns
            if not self._tracker.track(_in_base(points, mounting), self._expected(time_s)):
                self._log.warning("a scan does not match the previous ones")
            self._publish(header.stamp)

    def _find_mounting(self, frame: str) -> Pose | None:
        """Return the pose of the sensor on the robot, which must not change."""
        pose = IDENTITY if frame == self._base else self._frames.find(self._base, frame, 0)
        self._mounting = pose
        return pose

    def _publish(self, stamp: Any) -> None:
        pose, covariance = self._tracker.pose, np.diag(self._variances)
        if self._settings.do_compute_covariance:
            covariance[np.ix_((0, 1, 5), (0, 1, 5))] = self._tracker.covariance
        values: list[float] = covariance.ravel().tolist()
        for topic, publisher in self._poses.items():
            kind = _FORMS[topic][0]
            if topic == "pose2D":
                publisher.publish(load_message_class(kind)(*pose))
                continue
            is_stamped = kind.endswith("Stamped")
            made: Any = stamped(kind, self._fixed, stamp) if is_stamped else load_message_class(kind)()
            inner = made.pose if is_stamped and "Covariance" in kind else made
            if "Covariance" in kind:
                inner.covariance = values
            plane.fill(inner.pose.position, inner.pose.orientation, plane.raised(pose))
            publisher.publish(made)
        if self._tf is not None:
            self._tf.publish(plane.transforms(self._fixed, self._base, plane.raised(pose), stamp))


def _in_base(points: Any, mounting: Pose) -> Places:
    """Return points of the sensor's frame in the plane of the robot."""
    turn = rotation_matrix(mounting)
    x, y = (mounting[axis] + points @ np.array(turn[3 * axis : 3 * axis + 3]) for axis in (0, 1))
    found: Places = x + 1j * y
    return found


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("laser_scan_matcher_node", "laser_scan_matcher", LaserMatcherNode)
