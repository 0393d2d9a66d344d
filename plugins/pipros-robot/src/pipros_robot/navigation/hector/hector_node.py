"""The node hector_mapping, with the parameters, topics and services of that package."""

from __future__ import annotations

import logging
import math
import threading
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import IDENTITY, Pose, composed, inverted, rotation_matrix
from pipros_robot.navigation import plane
from pipros_robot.navigation.hector.occupancy import OccupancyPyramid, Places
from pipros_robot.navigation.plane import MAPPED_CELLS, MOST, Triple
from pipros_robot.perception.laser.projection import projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

TRANSFORM_S: Final = 0.5
"""Longest wait for a transform, on the node's clock."""


@dataclass(frozen=True, slots=True)
class HectorSettings:
    """The parameters by their ROS names. Lengths are in metres, angles in radians, times in seconds."""

    base_frame: str = "base_link"
    map_frame: str = "map"
    odom_frame: str = "odom"
    map_resolution: float = 0.025
    map_size: int = 1024
    map_start_x: float = 0.5
    map_start_y: float = 0.5
    map_update_distance_thresh: float = 0.4
    map_update_angle_thresh: float = 0.9
    map_pub_period: float = 2.0
    map_multi_res_levels: int = 3
    update_factor_free: float = 0.4
    update_factor_occupied: float = 0.9
    laser_min_dist: float = 0.4
    laser_max_dist: float = 30.0
    laser_z_min_value: float = -1.0
    laser_z_max_value: float = 1.0
    pub_map_odom_transform: bool = True
    pub_map_scanmatch_transform: bool = True
    tf_map_scanmatch_transform_frame_name: str = "scanmatcher_frame"
    pub_odometry: bool = False
    use_tf_pose_start_estimate: bool = False
    map_with_known_poses: bool = False
    advertise_map_service: bool = True
    scan_subscriber_queue_size: int = 5
    scan_topic: str = "scan"
    sys_msg_topic: str = "syscommand"
    pose_update_topic: str = "poseupdate"


_ENDLESS: Final = ("laser_max_dist", "laser_z_min_value", "laser_z_max_value")


class HectorNode:
    """Builds a map, and localises the robot on it. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register topics and services, and start publishing the map.

        Raises:
            InvalidParameter: a parameter has an invalid value.
        """
        given = read_parameters(node).read(HectorSettings, _ENDLESS)
        self._settings = settings = _checked(given, MAPPED_CELLS)
        self._base, self._map, self._odom = (
            each.lstrip("/") for each in (settings.base_frame, settings.map_frame, settings.odom_frame)
        )
        self._node, self._log, self._quiet, self._lock = node, log, Throttle(log, 5.0), threading.RLock()
        self._frames, self._is_paused = Frames(node, log), False
        size_m = settings.map_size * settings.map_resolution
        self._origin = complex(-size_m * settings.map_start_x, -size_m * settings.map_start_y)
        self._reset()
        self._maps = advertise(node, "map", "nav_msgs/OccupancyGrid", latch=True)
        self._metadata = advertise(node, "map_metadata", "nav_msgs/MapMetaData", latch=True)
        self._poses = advertise(node, "slam_out_pose", "geometry_msgs/PoseStamped")
        kind = "geometry_msgs/PoseWithCovarianceStamped"
        self._updates = advertise(node, settings.pose_update_topic, kind)
        self._odometry = (
            advertise(node, "scanmatch_odom", "nav_msgs/Odometry") if settings.pub_odometry else None
        )
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100)
        if settings.advertise_map_service:
            serve(node, "dynamic_map", "nav_msgs/GetMap", lambda _: self._map_message())
        serve(node, "reset_map", "std_srvs/Trigger", lambda _: self._reset_by("a request"))
        serve(node, "pause_mapping", "std_srvs/SetBool", self._pause)
        subscribe(node, settings.sys_msg_topic, "std_msgs/String", self._on_command, 2)
        subscribe(node, "initialpose", kind, self._on_pose, 2)
        subscribe(node, settings.scan_topic, "sensor_msgs/LaserScan", self._on_scan,
                  max(1, settings.scan_subscriber_queue_size))  # fmt: skip
        schedule.every(settings.map_pub_period, self._publish_map)

    # -- commands ----------------------------------------------------------------

    def _reset(self) -> None:
        """Forget the map, and return to its start."""
        settings = self._settings
        self._pyramid = OccupancyPyramid(
            settings.map_multi_res_levels, settings.map_size, settings.map_resolution, self._origin,
            settings.update_factor_free, settings.update_factor_occupied,
        )  # fmt: skip
        self._pose: Triple = (0.0, 0.0, 0.0)
        self._mapped: Triple | None = None
        self._covariance = np.zeros((3, 3))

    def _reset_by(self, who: str) -> tuple[bool, str]:
        with self._lock:
            self._reset()
        self._log.info("the map is reset by %s", who)
        return True, ""

    def _pause(self, request: Any) -> tuple[bool, str]:
        self._is_paused = bool(request.data)
        return True, ""

    def _on_command(self, message: Any) -> None:
        if message.data == "reset":
            self._reset_by("a command")

    def _on_pose(self, message: Any) -> None:
        """Continue from a pose on the map."""
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        if not plane.is_measured(pose):
            self._quiet.warning("an initial pose is dropped: it is invalid: %s", pose)
            return
        with self._lock:
            self._pose = plane.flat(pose)

    # -- scans -------------------------------------------------------------------

    def _on_scan(self, message: Any) -> None:
        stamp_ns, frame = in_ns(message.header.stamp), message.header.frame_id.lstrip("/")
        if self._is_paused:
            return
        mounting = self._found(self._base, frame, stamp_ns)
        points = None if mounting is None else self._points(message, mounting)
        if points is None:
            return
        if not len(points):
            self._quiet.warning("a scan is dropped: no beam is within the limits of distance and height")
            return
        known = None
        if self._settings.use_tf_pose_start_estimate or self._settings.map_with_known_poses:
            known = self._found(self._map, self._base, stamp_ns)
        with self._lock:
            self._match(points, None if known is None else plane.flat(known))
            self._publish(message.header.stamp, stamp_ns)

    def _found(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        if target == source:
            return IDENTITY
        return self._frames.awaited(target, source, stamp_ns, TRANSFORM_S)

    def _points(self, message: Any, mounting: Pose) -> Places:
        """Return the ends of beams in the robot's plane."""
        settings, scan = self._settings, Scan.of(message)
        with np.errstate(all="ignore"):
            beams = valid_beams(scan, settings.laser_max_dist)
            beams = beams[
                (scan.ranges[beams] > settings.laser_min_dist) & (scan.ranges[beams] < scan.range_max)
            ]
            points = projected(scan, plane.thinned(beams)).astype(float)
            points = points[(np.abs(points) <= MOST).all(axis=1)]
        points = points @ np.reshape(rotation_matrix(mounting), (3, 3)).T
        z = points[:, 2]
        points = points[(z > settings.laser_z_min_value) & (z < settings.laser_z_max_value)]
        found: Places = points[:, 0] + mounting[0] + 1j * (points[:, 1] + mounting[1])
        return found

    def _match(self, points: Places, known: Triple | None) -> None:
        settings, pyramid = self._settings, self._pyramid
        if known is not None:
            self._pose = known
        if self._mapped is not None and not settings.map_with_known_poses:
            self._pose, information = pyramid.matched(self._pose, points)
            resolution = settings.map_resolution
            self._covariance = np.linalg.inv(information + np.eye(3) / MOST) * resolution**2
        moved = math.inf if self._mapped is None else math.dist(self._pose[:2], self._mapped[:2])
        turned = 0.0 if self._mapped is None else math.remainder(self._pose[2] - self._mapped[2], math.tau)
        is_far = moved > settings.map_update_distance_thresh
        if is_far or abs(turned) > settings.map_update_angle_thresh:
            pyramid.add(self._pose, points)
            self._mapped = self._pose

    # -- publications ------------------------------------------------------------

    def _publish(self, stamp: Any, stamp_ns: int) -> None:
        settings, pose = self._settings, plane.raised(self._pose)
        made = stamped("geometry_msgs/PoseStamped", self._map, stamp)
        plane.fill(made.pose.position, made.pose.orientation, pose)
        self._poses.publish(made)
        covariance = np.zeros((6, 6))
        covariance[np.ix_((0, 1, 5), (0, 1, 5))] = self._covariance
        update = stamped("geometry_msgs/PoseWithCovarianceStamped", self._map, stamp)
        plane.fill(update.pose.pose.position, update.pose.pose.orientation, pose)
        update.pose.covariance = covariance.ravel().tolist()
        self._updates.publish(update)
        if self._odometry is not None:
            odometry = stamped("nav_msgs/Odometry", self._map, stamp, pose=update.pose)
            self._odometry.publish(odometry)
        if settings.pub_map_odom_transform:
            odom = self._found(self._odom, self._base, stamp_ns)
            if odom is not None:
                correction = composed(pose, inverted(odom))
                self._tf.publish(plane.transforms(self._map, self._odom, correction, stamp))
        if settings.pub_map_scanmatch_transform:
            name = settings.tf_map_scanmatch_transform_frame_name
            self._tf.publish(plane.transforms(self._map, name, pose, stamp))

    def _map_message(self) -> Any:
        settings = self._settings
        message = stamped("nav_msgs/OccupancyGrid", self._map, stamp(self._node.clock))
        with self._lock:
            message.data = self._pyramid.values().ravel()
        info = message.info
        info.map_load_time, info.resolution = message.header.stamp, settings.map_resolution
        info.width = info.height = settings.map_size
        info.origin.position.x, info.origin.position.y = self._origin.real, self._origin.imag
        info.origin.orientation.w = 1.0
        return message

    def _publish_map(self) -> None:
        if self._mapped is not None:
            message = self._map_message()
            self._maps.publish(message)
            self._metadata.publish(message.info)


def _checked(settings: HectorSettings, most_cells: int) -> HectorSettings:
    """Return the settings if they are valid; otherwise, raise InvalidParameter."""
    for name in ("map_resolution", "map_pub_period", "map_size", "map_multi_res_levels"):
        if not 0 < getattr(settings, name) < math.inf:
            raise InvalidParameter(f"~{name} must be > 0 and finite, got {getattr(settings, name)}")
    least, most = 2 ** min(settings.map_multi_res_levels, 30), math.isqrt(most_cells)
    if not least <= settings.map_size <= most:
        rule = f"from {least} (2 to the power of ~map_multi_res_levels) to {most}"
        raise InvalidParameter(f"~map_size must be {rule}, got {settings.map_size}")
    for name in ("update_factor_free", "update_factor_occupied"):
        if not 0 < getattr(settings, name) < 1:
            raise InvalidParameter(f"~{name} must be > 0 and < 1, got {getattr(settings, name)}")
    return settings


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("hector_mapping", "hector_mapping", HectorNode)
