"""The node and program navsat_transform_node: connects an `Alignment` to topics, services and transforms."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import TimeMovedBackwards, stamp
from pipros.node.service_server import CallFailed
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns, pose_of, vector_of
from pipros_libraries.transforms.pose import IDENTITY, Pose, Vector, inverted, rotate, rotation_matrix
from pipros_robot.navigation import plane
from pipros_robot.navigation.navsat.alignment import Alignment
from pipros_robot.navigation.navsat.geodesy import OutOfRange, zone_of_name
from pipros_robot.navigation.plane import Poses

_NO_FIX: Final = -1
_ORIGIN: Final = SimpleNamespace(x=0.0, y=0.0, z=0.0)


@dataclass(frozen=True, slots=True)
class NavsatSettings:
    """The parameters by their ROS names. Angles are in radians, times in seconds, frequencies in Hz."""

    frequency: float = 10.0
    delay: float = 0.0
    magnetic_declination_radians: float = 0.0
    yaw_offset: float = 0.0
    zero_altitude: bool = False
    broadcast_cartesian_transform: bool = False
    broadcast_cartesian_transform_as_parent_frame: bool = False
    cartesian_frame_id: str = ""
    use_local_cartesian: bool = False
    publish_filtered_gps: bool = False
    use_odometry_yaw: bool = False
    wait_for_datum: bool = False
    transform_timeout: float = 0.0


class NavsatNode:
    """Converts fixes to positions in the world frame, and back. Callbacks share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register topics and services, and start the cycle.

        Raises:
            InvalidParameter: a parameter has an invalid value.
        """
        self._node, self._log = node, log
        given = self._renamed(read_parameters(node))
        self._settings = settings = given.read(NavsatSettings)
        if not 0.0 < settings.frequency < math.inf:
            raise InvalidParameter(f"~frequency must be > 0 and finite, got {settings.frequency}")
        turn = settings.magnetic_declination_radians + settings.yaw_offset
        self._alignment = Alignment(settings.use_local_cartesian, turn)
        self._has_datum = settings.wait_for_datum
        self._world_frame, self._base_frame, self._antenna_frame = "odom", "base_link", ""
        self._lock = threading.RLock()
        self._fix: tuple[int, Vector] | None = None
        self._fix_covariance = self._pose_covariance = np.zeros((3, 3))
        self._pose: tuple[int, Pose] | None = None
        self._throttle = Throttle(log, 5.0)
        self._frames = Frames(node, log)
        self._static = advertise(node, "/tf_static", "tf2_msgs/TFMessage", 100, latch=True)
        handlers = self._set_datum, self._to_geographic, self._from_geographic, self._set_zone
        for name, handle in zip(("datum", "toLL", "fromLL", "setUTMZone"), handlers, strict=True):
            kind = "SetDatum" if name == "datum" else name[0].upper() + name[1:]
            serve(node, name, f"robot_localization/{kind}", partial(self._locked, handle))
        if self._has_datum and given.has("datum"):
            self._read_datum(given)
        subscribe(node, "odometry/filtered", "nav_msgs/Odometry", self._on_odometry)
        subscribe(node, "gps/fix", "sensor_msgs/NavSatFix", self._on_fix)
        self._imu: Any = None
        if not settings.use_odometry_yaw and not self._has_datum:
            self._imu = subscribe(node, "imu/data", "sensor_msgs/Imu", self._on_imu)
        self._positions = advertise(node, "odometry/gps", "nav_msgs/Odometry", 10)
        self._filtered: Any = None
        if settings.publish_filtered_gps:
            self._filtered = advertise(node, "gps/filtered", "sensor_msgs/NavSatFix", 10)
        if settings.delay > 0.0:
            with suppress(TimeMovedBackwards):
                node.clock.sleep(settings.delay)
        schedule.every(1.0 / settings.frequency, self._cycle)

    def _renamed(self, given: PrivateParameters) -> PrivateParameters:
        """Return the parameters with deprecated names replaced by current names."""
        values = dict(given.values)
        for ending in ("", "_as_parent_frame"):
            old, new = (f"broadcast_{kind}_transform{ending}" for kind in ("utm", "cartesian"))
            if old in values:
                self._log.warning("~%s is deprecated: use ~%s", old, new)
                values.setdefault(new, values[old])
        return PrivateParameters(values)

    def _locked(self, handle: Callable[[Any], Any], request: Any) -> Any:
        with self._lock:
            try:
                return handle(request)
            except OutOfRange as error:
                raise CallFailed(str(error)) from None

    # -- services --------------------------------------------------------------------

    def _read_datum(self, given: PrivateParameters) -> None:
        values = given.values["datum"]
        if not isinstance(values, list) or len(values) < 3:
            raise InvalidParameter(f"~datum must be a list of latitude, longitude and yaw, got {values!r}")
        if len(values) > 3:
            self._log.warning("only the first three elements of ~datum are used: latitude, longitude, yaw")
        latitude, longitude, yaw = PrivateParameters({"datum": values[:3]}).numbers("datum", 3, ())
        try:
            self._use_datum((latitude, longitude, 0.0), plane.raised((0.0, 0.0, yaw)))
        except OutOfRange as error:
            raise InvalidParameter(f"~datum: {error}") from None

    def _set_datum(self, request: Any) -> None:
        position, turn = request.geo_pose.position, request.geo_pose.orientation
        self._use_datum((position.latitude, position.longitude, position.altitude), pose_of(_ORIGIN, turn))

    def _use_datum(self, position: Vector, orientation: Pose) -> None:
        """Use a position and orientation as the origin of the world frame."""
        if not plane.is_measured((*position, *orientation[3:])):
            raise OutOfRange(
                f"position and orientation must be finite and known, got {position}, {orientation[3:]}"
            )
        alignment = self._alignment
        alignment.set_fix(*position)
        self._has_datum = True
        alignment.to_world, alignment.odometry = None, IDENTITY
        alignment.set_attitude(orientation, IDENTITY)
        self._log.info("the datum is %s, %s, %s", *position)

    def _to_geographic(self, request: Any) -> Any:
        self._require_transform()
        point: Any = load_message_class("geographic_msgs/GeoPoint")
        return point(*self._alignment.geographic(vector_of(request.map_point)))

    def _from_geographic(self, request: Any) -> Any:
        self._require_transform()
        point: Any = load_message_class("geometry_msgs/Point")
        given = request.ll_point
        in_plane = self._alignment.in_plane(given.latitude, given.longitude, given.altitude)
        x, y, z = self._alignment.in_world(in_plane)
        return point(x, y, 0.0 if self._settings.zero_altitude else z)

    def _require_transform(self) -> None:
        if self._alignment.to_world is None:
            raise CallFailed("the transform to the world frame is not known yet")

    def _set_zone(self, request: Any) -> None:
        self._alignment.set_zone(*zone_of_name(request.utm_zone))
        self._has_datum = False
        self._log.info("the UTM zone is %s", request.utm_zone)

    # -- topics ----------------------------------------------------------------------

    def _on_fix(self, message: Any) -> None:
        position = message.latitude, message.longitude, message.altitude
        with self._lock:
            self._antenna_frame = message.header.frame_id.lstrip("/")
            if message.status.status == _NO_FIX or any(map(math.isnan, position)):
                return
            if not all(abs(each) <= plane.MOST for each in position):
                self._throttle.warning("a fix is dropped: its position must be finite, got %s", position)
                return
            try:
                if self._alignment.to_world is None and not self._has_datum:
                    self._alignment.set_fix(*position)
                in_plane = self._alignment.in_plane(*position)
            except OutOfRange as error:
                self._throttle.warning("a fix is dropped: %s", error)
                return
            self._fix = in_ns(message.header.stamp), in_plane
            self._is_fix_new = True
            self._fix_covariance = np.array(message.position_covariance, float).reshape(3, 3)

    _is_fix_new = _is_pose_new = False

    def _on_odometry(self, message: Any) -> None:
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        if not plane.is_measured(pose):
            self._throttle.warning(
                "an odometry message is dropped: its pose is not finite, or has no orientation"
            )
            return
        with self._lock:
            self._world_frame = message.header.frame_id.lstrip("/")
            self._base_frame = message.child_frame_id.lstrip("/")
            if self._alignment.to_world is None and not self._has_datum:
                self._alignment.odometry = pose
                if self._settings.use_odometry_yaw:
                    self._alignment.set_attitude(pose, IDENTITY)
            self._pose = in_ns(message.header.stamp), pose
            self._is_pose_new = True
            self._pose_covariance = np.array(message.pose.covariance, float).reshape(6, 6)[:3, :3]

    def _on_imu(self, message: Any) -> None:
        with self._lock:
            if self._alignment.odometry is None:  # the frame of the robot is not known
                return
            stamp_ns, frame = in_ns(message.header.stamp), message.header.frame_id.lstrip("/")
            mounting = self._find(self._base_frame, frame or self._base_frame, stamp_ns)
            attitude = pose_of(_ORIGIN, message.orientation)
            if mounting is not None and plane.is_measured(attitude):
                self._alignment.set_attitude(attitude, mounting)

    def _find(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        if not (target and source):
            return None
        return self._frames.find(target, source, stamp_ns, self._settings.transform_timeout)

    # -- the cycle -------------------------------------------------------------------

    def _cycle(self) -> None:
        with self._lock, np.errstate(all="ignore"):  # covariances of inputs may be infinite
            if self._alignment.to_world is None:
                antenna = None
                if not self._has_datum and self._alignment.attitude is not None:
                    antenna = self._find(self._base_frame, self._antenna_frame, 0)
                if self._alignment.align(antenna):
                    self._use_transform()
                return
            if self._is_fix_new and self._is_pose_new:
                self._is_fix_new = False
                self._publish_position()
            if self._filtered is not None and self._is_pose_new and self._pose is not None:
                self._is_pose_new = False
                stamp_ns, pose = self._pose
                try:
                    place = self._alignment.geographic(pose[:3])
                except OutOfRange as error:
                    self._throttle.warning("no fix is published: %s", error)
                    return
                covariance = turned(inverted(self._alignment.to_world), self._pose_covariance)
                self._filtered.publish(filtered_fix(self._base_frame, stamp_ns, place, covariance))

    def _use_transform(self) -> None:
        """Unsubscribe from the IMU, and send the transform if `broadcast_cartesian_transform` is set."""
        if self._imu is not None and not self._has_datum:
            self._imu.unregister()
            self._imu = None
        pose = self._alignment.to_world
        settings = self._settings
        if not settings.broadcast_cartesian_transform or pose is None:
            return
        usual = "local_enu" if settings.use_local_cartesian else "utm"
        parent, child = self._world_frame, settings.cartesian_frame_id or usual
        if settings.broadcast_cartesian_transform_as_parent_frame:
            parent, child, pose = child, parent, inverted(pose)
        message = plane.transforms(parent, child, pose, stamp(self._node.clock))
        if self._settings.zero_altitude:
            message.transforms[0].transform.translation.z = 0.0
        self._static.publish(message)

    def _publish_position(self) -> None:
        """Publish the robot's position in the world frame, computed from the antenna's position.

        If the pose of the antenna or of the robot is unknown, warn and publish the origin.
        """
        alignment = self._alignment
        if self._fix is None or alignment.to_world is None:
            return
        stamp_ns, in_plane = self._fix
        x, y, z = alignment.in_world(in_plane)
        if self._settings.zero_altitude:
            z = 0.0
        antenna = self._find(self._base_frame, self._antenna_frame, stamp_ns)
        base = self._find(self._world_frame, self._base_frame, stamp_ns) if antenna is not None else None
        if antenna is None or base is None:
            frame = self._antenna_frame or "the receiver"
            self._throttle.warning(
                "the pose of %s on the robot, or of the robot in %s, is unknown", frame, self._world_frame
            )
            x = y = z = 0.0
        else:
            dx, dy, dz = rotate(base, antenna[:3])
            x, y, z = x - dx, y - dy, z - dz
        self._fix_covariance = turned(alignment.to_world, self._fix_covariance)
        place = x, y, 0.0 if self._settings.zero_altitude else z
        self._positions.publish(position(self._world_frame, stamp_ns, place, self._fix_covariance))


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("navsat_transform_node", "robot_localization", NavsatNode)


def position(frame: str, stamp_ns: int, place: Vector, covariance: Poses) -> Any:
    """Return a position and its covariance, of shape (3, 3), as nav_msgs/Odometry."""
    message = stamped("nav_msgs/Odometry", frame, stamp_ns)
    plane.fill(message.pose.pose.position, message.pose.pose.orientation, (*place, *IDENTITY[3:]))
    message.pose.covariance = np.pad(covariance, (0, 3)).ravel().tolist()
    return message


def filtered_fix(frame: str, stamp_ns: int, place: Vector, covariance: Poses) -> Any:
    """Return latitude, longitude and altitude as sensor_msgs/NavSatFix."""
    message = stamped("sensor_msgs/NavSatFix", frame, stamp_ns)
    message.latitude, message.longitude, message.altitude = place
    message.position_covariance = covariance.ravel().tolist()
    message.position_covariance_type = message.COVARIANCE_TYPE_KNOWN
    message.status.status = message.status.STATUS_GBAS_FIX
    return message


def turned(pose: Pose, covariance: Poses) -> Poses:
    """Rotate a covariance of shape (3, 3) from a frame with the given pose to its parent frame."""
    matrix = np.array(rotation_matrix(pose)).reshape(3, 3)
    found: Poses = matrix @ covariance @ matrix.T
    return found
