"""The node navsat_transform_node: topics, services and the transform around an `Alignment`; its program."""

from __future__ import annotations

import logging
import math
import threading
import time
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.libraries.transforms.messages import in_ns, pose_of
from pipros.libraries.transforms.pose import IDENTITY, Pose, Vector, inverted, rotate
from pipros.msg import load_message_class, load_service_class
from pipros.navigation import plane
from pipros.navigation.frames import Frames
from pipros.navigation.navsat.alignment import Alignment
from pipros.navigation.navsat.geodesy import OutOfRange, zone_of_name
from pipros.navigation.navsat.messages import filtered_fix, position, turned
from pipros.navigation.parameters import InvalidParameter, Parameters, read_parameters
from pipros.navigation.schedule import Schedule
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.node.service_server import CallFailed
from pipros.node.subscriber import Subscriber

_NO_FIX: Final = -1
_WARNING_S: Final = 5.0
_ORIGIN: Final = SimpleNamespace(x=0.0, y=0.0, z=0.0)


class NavsatNode:
    """Converts fixes to positions in the world frame, and back. Callbacks share one lock."""

    def __init__(self, node: Node, log: logging.Logger, parameters: Parameters) -> None:
        """Register topics and services.

        Raises:
            InvalidParameter: the node cannot run with a parameter.
        """
        self._node, self._log = node, log
        read = parameters
        turn = read.number("magnetic_declination_radians", 0.0) + read.number("yaw_offset", 0.0)
        self._alignment = Alignment(read.boolean("use_local_cartesian", False), turn)
        self._is_flat = read.boolean("zero_altitude", False)
        self._uses_odometry_yaw = read.boolean("use_odometry_yaw", False)
        self._has_datum = read.boolean("wait_for_datum", False)
        self._timeout_s = read.number("transform_timeout", 0.0)
        self._is_cartesian_sent, self._is_parent = (
            self._renamed(read, f"broadcast_{{}}_transform{ending}") for ending in ("", "_as_parent_frame")
        )
        usual = "local_enu" if self._alignment.is_local else "utm"
        self._cartesian_frame = read.text("cartesian_frame_id", usual)
        self._world_frame, self._base_frame, self._antenna_frame = "odom", "base_link", ""
        self._lock = threading.RLock()
        self._fix: tuple[int, Vector] | None = None
        self._fix_covariance = np.zeros((3, 3))
        self._pose: tuple[int, Pose] | None = None
        self._pose_covariance = np.zeros((3, 3))
        self._warned_s = -_WARNING_S
        self._frames = Frames(node, log)
        self._load_classes()
        self._serve("datum", "SetDatum", lambda request: self._set_datum(request.geo_pose))
        self._serve("toLL", "ToLL", self._to_geographic)
        self._serve("fromLL", "FromLL", self._from_geographic)
        self._serve("setUTMZone", "SetUTMZone", self._set_zone)
        if self._has_datum and read.has("datum"):
            self._read_datum(read)
        self._start(read)

    def _renamed(self, parameters: Parameters, name: str) -> bool:
        """Return a flag that had another name before."""
        new, old = name.format("cartesian"), name.format("utm")
        if parameters.has(old):
            self._log.warning("~%s is deprecated: use ~%s", old, new)
        return parameters.boolean(new, parameters.boolean(old, False))

    def _load_classes(self) -> None:
        self._odometry_class: Any = load_message_class("nav_msgs/Odometry")
        self._fix_class: Any = load_message_class("sensor_msgs/NavSatFix")
        tf: Any = load_message_class("tf2_msgs/TFMessage")
        self._static = self._node.advertise("/tf_static", tf, queue_size=100, latch=True)

    def _start(self, read: Parameters) -> None:
        """Subscribe, advertise, and start the cycle."""
        node = self._node
        node.subscribe("odometry/filtered", self._odometry_class, self._on_odometry, queue_size=1)
        node.subscribe("gps/fix", self._fix_class, self._on_fix, queue_size=1)
        self._imu: Subscriber[Any] | None = None
        if not self._uses_odometry_yaw and not self._has_datum:
            imu: Any = load_message_class("sensor_msgs/Imu")
            self._imu = node.subscribe("imu/data", imu, self._on_imu, queue_size=1)
        self._positions = node.advertise("odometry/gps", self._odometry_class, queue_size=10)
        self._filtered = None
        if read.boolean("publish_filtered_gps", False):
            self._filtered = node.advertise("gps/filtered", self._fix_class, queue_size=10)
        frequency, delay_s = read.number("frequency", 10.0), read.number("delay", 0.0)
        if not 0.0 < frequency < math.inf:
            raise InvalidParameter(f"~frequency must be > 0, got {frequency}")
        if delay_s > 0.0:
            node.clock.sleep(delay_s)
        schedule = Schedule(node)
        schedule.every(1.0 / frequency, self._cycle)
        schedule.start()

    def _serve(self, name: str, type_name: str, handle: Any) -> None:
        service = load_service_class(f"robot_localization/{type_name}")

        def respond(request: Any) -> Any:
            with self._lock:
                answer = handle(request)
            return service._response_class(*([] if answer is None else [answer]))

        self._node.serve(name, service, respond)

    # -- services --------------------------------------------------------------------

    def _read_datum(self, read: Parameters) -> None:
        values = read.values["datum"]
        if not isinstance(values, list) or len(values) < 3:
            raise InvalidParameter(f"~datum must be a list of latitude, longitude and yaw, got {values!r}")
        if len(values) > 3:
            self._log.warning("only the first three elements of ~datum are used: latitude, longitude, yaw")
        latitude, longitude, yaw = Parameters({"datum": values[:3]}).numbers("datum", 3, ())
        pose: Any = load_message_class("geographic_msgs/GeoPose")()
        pose.position.latitude, pose.position.longitude = latitude, longitude
        pose.orientation.z, pose.orientation.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)
        try:
            self._set_datum(pose)
        except CallFailed as error:
            raise InvalidParameter(f"~datum: {error}") from None

    def _set_datum(self, pose: Any) -> None:
        """Use a position and orientation as the origin of the world frame."""
        position, alignment = pose.position, self._alignment
        try:
            alignment.set_fix(position.latitude, position.longitude, position.altitude)
        except OutOfRange as error:
            raise CallFailed(str(error)) from None
        self._has_datum = True
        alignment.to_world, alignment.odometry = None, IDENTITY
        alignment.set_attitude(pose_of(_ORIGIN, pose.orientation), IDENTITY)
        self._log.info("the datum is %s, %s, %s", position.latitude, position.longitude, position.altitude)

    def _to_geographic(self, request: Any) -> Any:
        self._require_transform()
        point: Any = load_message_class("geographic_msgs/GeoPoint")
        given = request.map_point
        return point(*self._alignment.geographic((given.x, given.y, given.z)))

    def _from_geographic(self, request: Any) -> Any:
        self._require_transform()
        point: Any = load_message_class("geometry_msgs/Point")
        given = request.ll_point
        try:
            in_plane = self._alignment.in_plane(given.latitude, given.longitude, given.altitude)
        except OutOfRange as error:
            raise CallFailed(str(error)) from None
        x, y, z = self._alignment.in_world(in_plane)
        return point(x, y, 0.0 if self._is_flat else z)

    def _require_transform(self) -> None:
        if self._alignment.to_world is None:
            raise CallFailed("the transform to the world frame is not known yet")

    def _set_zone(self, request: Any) -> None:
        try:
            self._alignment.set_zone(*zone_of_name(request.utm_zone))
        except OutOfRange as error:
            raise CallFailed(str(error)) from None
        self._has_datum = False
        self._log.info("the UTM zone is %s", request.utm_zone)

    # -- topics ----------------------------------------------------------------------

    def _on_fix(self, message: Any) -> None:
        position = message.latitude, message.longitude, message.altitude
        with self._lock:
            self._antenna_frame = message.header.frame_id.lstrip("/")
            if message.status.status == _NO_FIX or any(map(math.isnan, position)):
                return
            try:
                if self._alignment.to_world is None and not self._has_datum:
                    self._alignment.set_fix(*position)
                in_plane = self._alignment.in_plane(*position)
            except OutOfRange as error:
                self._warn(str(error))
                return
            self._fix = in_ns(message.header.stamp), in_plane
            self._is_fix_new = True
            self._fix_covariance = np.array(message.position_covariance, float).reshape(3, 3)

    _is_fix_new = _is_pose_new = False

    def _on_odometry(self, message: Any) -> None:
        pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
        with self._lock:
            self._world_frame = message.header.frame_id.lstrip("/")
            self._base_frame = message.child_frame_id.lstrip("/")
            if self._alignment.to_world is None and not self._has_datum:
                self._alignment.odometry = pose
                if self._uses_odometry_yaw:
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
            if mounting is not None:
                self._alignment.set_attitude(pose_of(_ORIGIN, message.orientation), mounting)

    def _find(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        if not (target and source):
            return None
        return self._frames.find(target, source, stamp_ns, self._timeout_s)

    def _warn(self, text: str) -> None:
        if time.monotonic() - self._warned_s >= _WARNING_S:
            self._warned_s = time.monotonic()
            self._log.warning("%s", text)

    # -- the cycle -------------------------------------------------------------------

    def _cycle(self) -> None:
        with self._lock:
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
                place = self._alignment.geographic(pose[:3])
                covariance = turned(inverted(self._alignment.to_world), self._pose_covariance)
                self._filtered.publish(filtered_fix(self._base_frame, stamp_ns, place, covariance))

    def _use_transform(self) -> None:
        """Unsubscribe from the orientation, and send the transform if requested."""
        if self._imu is not None and not self._has_datum:
            self._imu.unregister()
            self._imu = None
        pose = self._alignment.to_world
        if not self._is_cartesian_sent or pose is None:
            return
        parent, child = self._world_frame, self._cartesian_frame
        if self._is_parent:
            parent, child, pose = child, parent, inverted(pose)
        message = plane.transforms(parent, child, pose, self._node.clock.now_ns())
        if self._is_flat:
            message.transforms[0].transform.translation.z = 0.0
        self._static.publish(message)

    def _publish_position(self) -> None:
        """Publish the robot's position in the world frame, from the antenna's."""
        alignment = self._alignment
        if self._fix is None or alignment.to_world is None:
            return
        stamp_ns, in_plane = self._fix
        x, y, z = alignment.in_world(in_plane)
        if self._is_flat:
            z = 0.0
        antenna = self._find(self._base_frame, self._antenna_frame, stamp_ns)
        base = self._find(self._world_frame, self._base_frame, stamp_ns) if antenna is not None else None
        if antenna is None or base is None:
            self._warn(f"the offset of {self._antenna_frame or 'the receiver'} on the robot is not known")
            x = y = z = 0.0
        else:
            dx, dy, dz = rotate(base, antenna[:3])
            x, y, z = x - dx, y - dy, z - dz
        self._fix_covariance = turned(alignment.to_world, self._fix_covariance)
        place = x, y, 0.0 if self._is_flat else z
        self._positions.publish(position(self._world_frame, stamp_ns, place, self._fix_covariance))


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    with roscpp_program("navsat_transform_node", "robot_localization") as (node, log):
        try:
            NavsatNode(node, log, read_parameters(node))
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        node.wait_for_shutdown()
    return 0
