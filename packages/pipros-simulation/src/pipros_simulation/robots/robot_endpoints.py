"""Topics and services of one simulated robot."""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, Final

from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.node.service_server import CallFailed
from pipros_simulation.robots.drive import Motion, Pose
from pipros_simulation.robots.errors import Rejected
from pipros_simulation.robots.robot import SimulatedRobot
from pipros_simulation.robots.settings import Imu
from pipros_simulation.robots.simulation import Ranges, Simulation

_DISCHARGING, _CHARGING, _FULL = 2, 1, 4
_GOOD, _LITHIUM_ION = 1, 2
GRAVITY: Final = 9.81
STEERING: Final = {"drive": "AckermannDriveStamped", "ackermann_cmd": "AckermannDrive"}
"""Topics on which cars take speeds and angles of the steering, with their types in ackermann_msgs."""
_LEAST_DEVIATION: Final = 1e-4
"""Reported instead of a smaller deviation: in messages, a variance of 0 means that it is unknown."""


@dataclass(frozen=True, slots=True)
class RobotInterface:
    """The names of a robot's frames, joints and sensor topics, and the transforms that it publishes.

    Attributes:
        odom_frame: frame of the odometry.
        base_frames: frames of the robot, all with the same origin. The first is a child of `odom_frame`; each
            other frame is a child of its predecessor.
        scan_frame, scan_topic: frame and topic of the laser.
        imu_frame, imu_topic: frame and topic of the inertial measurement unit.
        wheel_joints: the joints of the left and the right wheel.
        has_tf: whether the transform from `odom_frame` to the robot is published.
        has_static_tf: whether the transforms between the robot's frames are published.
        has_base: whether the robot has the topics `cmd_vel`, `odom` and `joint_states`, those of
            `STEERING` if it is a car, and `odom_frame`. Otherwise, its controllers have them.
    """

    odom_frame: str = "odom"
    base_frames: tuple[str, ...] = ("base_footprint", "base_link")
    scan_frame: str = "base_scan"
    scan_topic: str = "scan"
    imu_frame: str = "imu_link"
    imu_topic: str = "imu"
    wheel_joints: tuple[str, str] = ("wheel_left_joint", "wheel_right_joint")
    has_tf: bool = True
    has_static_tf: bool = True
    has_base: bool = True

    def of(self, robot: str) -> RobotInterface:
        """Return the names with the robot's name as a prefix, or unchanged if the robot's name is empty."""
        if not robot:
            return self
        prefixed: dict[str, Any] = {
            each.name: f"{robot}/{value}"
            for each in fields(self)
            if isinstance(value := getattr(self, each.name), str)
        }
        left, right = self.wheel_joints
        return replace(
            self,
            **prefixed,
            base_frames=tuple(f"{robot}/{frame}" for frame in self.base_frames),
            wheel_joints=(f"{robot}/{left}", f"{robot}/{right}"),
        )


class RobotEndpoints:
    """Publishes a robot's measurements, and passes commands to the robot.

    Names are relative to the node's namespace.
    """

    def __init__(
        self, node: Node, name: str, simulation: Simulation, lock: threading.Lock, names: RobotInterface
    ) -> None:
        """Register topics and services.

        Args:
            lock: held while the simulation is used.
            names: names for this robot, as returned by `RobotInterface.of`.
        """
        self.names: Final = names
        self._name = name
        self._simulation = simulation
        self._robot: SimulatedRobot = simulation.robots[name]
        self._lock = lock
        self._log = node.log
        self._has_warned = False
        prefix = f"{name}/" if name else ""
        self._stamps = HeaderFactory()
        self._was_bumped: bool | None = None

        def advertise(topic: str, kind: str, *, latch: bool = False) -> tuple[Any, Any]:
            message_class: Any = load_message_class(kind)
            return node.advertise(topic, message_class, queue_size=10, latch=latch), message_class

        self._truth, _ = advertise(f"{prefix}base_pose_ground_truth", "nav_msgs/Odometry")
        self._battery, self._battery_class = advertise(f"{prefix}battery_state", "sensor_msgs/BatteryState")
        self._bumper, self._bumper_class = advertise(f"{prefix}bumper", "std_msgs/Bool", latch=True)
        if self._robot.settings.laser is not None:
            self._scan, self._scan_class = advertise(names.scan_topic, "sensor_msgs/LaserScan")
        if self._robot.settings.imu is not None:
            self._imu, self._imu_class = advertise(names.imu_topic, "sensor_msgs/Imu")
        if names.has_base:
            self._odom, _ = advertise(f"{prefix}odom", "nav_msgs/Odometry")
            self._joints, self._joints_class = advertise(f"{prefix}joint_states", "sensor_msgs/JointState")
            twist = load_message_class("geometry_msgs/Twist")
            node.subscribe(f"{prefix}cmd_vel", twist, self._command, queue_size=1)
            for topic, kind in STEERING.items() if self._robot.settings.is_car else ():
                steering = load_message_class(f"ackermann_msgs/{kind}")
                node.subscribe(f"{prefix}{topic}", steering, self._steer, queue_size=1)
        serve(node, f"{prefix}place", "pipros_sim/Place", self._place)
        serve(node, f"{prefix}charge", "std_srvs/SetBool", self._charge)

    @property
    def wants_scan(self) -> bool:
        """Whether the robot has a laser whose scans have a subscriber."""
        return self._robot.settings.laser is not None and bool(self._scan.connection_count)

    def publish_motion(self, stamp: Time) -> None:
        """Publish bumper changes and, if there are subscribers, odometry, the true pose and joint states."""
        robot, names = self._robot, self.names
        if names.has_base and self._odom.connection_count:
            self._odom.publish(self._odometry(stamp, names.odom_frame, robot.odometry))
        if self._truth.connection_count:
            self._truth.publish(self._odometry(stamp, names.odom_frame, robot.pose))
        if names.has_base and self._joints.connection_count:
            joints = self._joints_class()
            joints.header = self._stamps.header(stamp, "")
            joints.name = list(names.wheel_joints)
            joints.position, joints.velocity = list(robot.wheels), list(robot.wheel_speeds)
            self._joints.publish(joints)
        if robot.settings.imu is not None and self._imu.connection_count:
            self._imu.publish(self._measured(stamp, robot.settings.imu))
        if robot.is_bumped != self._was_bumped:
            self._was_bumped = robot.is_bumped
            self._bumper.publish(self._bumper_class(robot.is_bumped))

    def _measured(self, stamp: Time, imu: Imu) -> Any:
        """Return what the inertial measurement unit measures now: z points up, so gravity is positive."""
        robot, message = self._robot, self._imu_class()
        noise = robot.noise(self._simulation.steps, 1).standard_normal(7).tolist()
        message.header = self._stamps.header(stamp, self.names.imu_frame)
        yaw = robot.pose.yaw + imu.yaw_noise * noise[0]
        message.orientation.z, message.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        rates = message.angular_velocity
        rates.x, rates.y, rates.z = (imu.gyro_noise * each for each in noise[1:4])
        rates.z += robot.velocity.turn
        measured = message.linear_acceleration
        measured.x, measured.y, measured.z = (imu.acceleration_noise * each for each in noise[4:])
        measured.x += robot.acceleration[0]
        measured.y += robot.acceleration[1]
        measured.z += GRAVITY
        for name, deviation in (
            ("orientation", imu.yaw_noise),
            ("angular_velocity", imu.gyro_noise),
            ("linear_acceleration", imu.acceleration_noise),
        ):
            variance = max(deviation, _LEAST_DEVIATION) ** 2
            setattr(message, f"{name}_covariance", [variance, 0, 0, 0, variance, 0, 0, 0, variance])
        return message

    def publish_battery(self, stamp: Time) -> None:
        """Publish the battery state if the topic has subscribers."""
        if not self._battery.connection_count:
            return
        battery, message = self._robot.battery, self._battery_class()
        message.header = self._stamps.header(stamp, "")
        message.voltage, message.current = battery.voltage, battery.current_a
        message.charge, message.percentage = battery.charge_ah, battery.percentage
        message.capacity = message.design_capacity = battery.settings.capacity_ah
        message.temperature = math.nan  # the temperature is not measured
        is_full = battery.is_charging and battery.percentage >= 1.0
        message.power_supply_status = _FULL if is_full else _CHARGING if battery.is_charging else _DISCHARGING
        message.power_supply_health, message.power_supply_technology = _GOOD, _LITHIUM_ION
        message.present = True
        self._battery.publish(message)

    def publish_scan(self, stamp: Time, ranges: Ranges, interval_s: float) -> None:
        """Publish a scan, taken `interval_s` after the previous one. Do nothing if the robot has no laser."""
        laser = self._robot.settings.laser
        if laser is None:
            return
        scan = self._scan_class()
        scan.header = self._stamps.header(stamp, self.names.scan_frame)
        scan.angle_min, scan.angle_increment = laser.min_angle, laser.increment
        scan.angle_max = laser.min_angle + laser.increment * (laser.rays - 1)
        scan.scan_time = interval_s
        scan.range_min, scan.range_max = laser.range_min, laser.range_max
        scan.ranges = ranges.tolist()
        self._scan.publish(scan)

    def transform(self, stamp: Time) -> Any:
        """Return the transform from the odometry frame to the first of the robot's frames."""
        return self._stamps.transform(
            stamp, self.names.odom_frame, self.names.base_frames[0], self._robot.odometry
        )

    def fixed_transforms(self, stamp: Time) -> list[Any]:
        """Return the transforms between the frames of the robot and its sensors."""
        frames = self.names.base_frames
        found = [
            self._stamps.transform(stamp, parent, child, Pose())
            for parent, child in itertools.pairwise(frames)
        ]
        laser = self._robot.settings.laser
        if laser is not None:
            found.append(
                self._stamps.transform(stamp, frames[-1], self.names.scan_frame, laser.pose, laser.z)
            )
            if laser.is_upside_down:  # a roll of pi, then the yaw
                turn = found[-1].transform.rotation
                turn.x, turn.y, turn.z, turn.w = turn.w, turn.z, 0.0, 0.0
        imu = self._robot.settings.imu
        if imu is not None:
            place = Pose(imu.x, imu.y)
            found.append(self._stamps.transform(stamp, frames[-1], self.names.imu_frame, place, imu.z))
        return found

    def _odometry(self, stamp: Time, frame: str, pose: Pose) -> Any:
        header = self._stamps.header(stamp, frame)
        return odometry_message(header, self.names.base_frames[0], pose, self._robot.velocity)

    def _command(self, twist: Any) -> None:
        linear, sideways, angular = twist.linear.x, twist.linear.y, twist.angular.z
        if self._are_finite(linear, sideways, angular):
            with self._lock:
                self._robot.command(linear, angular, self._simulation.time_s, sideways)

    def _steer(self, message: Any) -> None:
        drive = getattr(message, "drive", message)
        if self._are_finite(drive.speed, drive.steering_angle):
            with self._lock:
                self._robot.steer(drive.speed, drive.steering_angle, self._simulation.time_s)

    def _are_finite(self, *values: float) -> bool:
        """Return whether the values of a command are finite. Log the first ones that are not."""
        is_finite = all(map(math.isfinite, values))
        if not is_finite and not self._has_warned:
            self._has_warned = True
            shown = ", ".join(map(str, values))
            self._log.warning("[%s] ignores commands that are not finite: %s", self._name, shown)
        return is_finite

    def _place(self, request: Any) -> None:
        try:
            with self._lock:
                self._simulation.place(self._name, Pose(request.x, request.y, request.theta))
        except Rejected as error:
            self._log.error("%s", error)
            raise CallFailed from None

    def _charge(self, request: Any) -> Any:
        with self._lock:
            self._robot.battery.is_charging = request.data
        return {"success": True, "message": "charging" if request.data else "not charging"}


def odometry_message(header: Any, child: str, pose: Pose, velocity: Motion) -> Any:
    """Return a nav_msgs/Odometry without covariances."""
    message: Any = load_message_class("nav_msgs/Odometry")()
    message.header, message.child_frame_id = header, child
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    place.x, place.y = pose.x, pose.y
    turn.z, turn.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = velocity.forwards, velocity.sideways, velocity.turn
    return message


class HeaderFactory:
    """Creates headers and transforms."""

    def __init__(self) -> None:
        self._header_class: Any = load_message_class("std_msgs/Header")
        self._transform_class: Any = load_message_class("geometry_msgs/TransformStamped")

    def header(self, stamp: Time, frame: str) -> Any:
        return self._header_class(stamp=stamp, frame_id=frame)

    def transform(self, stamp: Time, parent: str, child: str, pose: Pose, height: float = 0.0) -> Any:
        message = self._transform_class(header=self.header(stamp, parent), child_frame_id=child)
        shift, turn = message.transform.translation, message.transform.rotation
        shift.x, shift.y, shift.z = pose.x, pose.y, height
        turn.z, turn.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
        return message


def serve(node: Node, name: str, kind: str, handler: Callable[[Any], Any]) -> None:
    """Serve a service whose handler returns the fields of the response, or None."""
    service: Any = load_service_class(kind)
    node.serve(name, service, lambda request: service._response_class(**(handler(request) or {})))
