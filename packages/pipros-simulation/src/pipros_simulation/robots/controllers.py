"""Controllers of a simulated base, which `controller_manager` loads.

`diff_drive_controller/DiffDriveController` and `joint_state_controller/JointStateController` have the topics
and parameters of ros_control's (http://wiki.ros.org/diff_drive_controller), on the robot of a `Simulation`.
The geometry of the wheels is the robot's, so the parameters that describe it have no effect.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics import names
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.robot_endpoints import HeaderFactory, odometry_message
from pipros_simulation.robots.settings import number
from pipros_simulation.robots.simulation import STEP_S, Simulation

_LEAST_RATE: Final = 1e-6
_STATES: Final = ("position", "velocity", "effort")


class Controller:
    """A controller that is loaded.

    Attributes:
        interface: the hardware interface that it uses.
        joints: the joints that no other controller may use while it runs.
    """

    interface: str
    joints: tuple[str, ...] = ()

    def __init__(self) -> None:
        self._topics: list[Any] = []

    def start(self) -> None:
        """Begin without commands."""

    def stop(self) -> None:
        """Stop what the controller moves."""

    def update(self, now_s: float) -> None:
        """Command the robot before a step."""

    def publish(self, stamp: Time, steps: int) -> None:
        """Publish measurements after a step, as often as `publish_rate` says."""

    def close(self) -> None:
        """Unregister all topics."""
        for topic in self._topics:
            topic.unregister()


@dataclass(frozen=True, slots=True)
class Limiter:
    """Limits of a velocity, in m/s and m/s² or in rad/s and rad/s²."""

    low: float = -math.inf
    high: float = math.inf
    slowest: float = -math.inf
    fastest: float = math.inf

    @classmethod
    def of(cls, params: Mapping[str, Any], where: str) -> Limiter:
        """Read the parameters `has_velocity_limits`, `max_velocity`, …

        Raises:
            InvalidSettings: a limit is not a finite number, or the limits leave no way to stop.
        """
        found = []
        for quantity in ("velocity", "acceleration"):
            low, high = -math.inf, math.inf
            if params.get(f"has_{quantity}_limits") is True:
                high = number(params.get(f"max_{quantity}"), f"{where}/max_{quantity}")
                low = number(params.get(f"min_{quantity}", -high), f"{where}/min_{quantity}")
                # Otherwise, a robot that nobody drives could not stop.
                if not low <= 0 <= high or (low * high == 0 and quantity == "acceleration"):
                    zero = "" if quantity == "velocity" else ", and not 0"
                    ends = f"{where}/min_{quantity} must be <= 0, and max_{quantity} >= 0{zero}"
                    raise InvalidSettings(f"{ends}, got {low:g} and {high:g}")
            found += [low, high]
        return cls(*found)

    def limited(self, wanted: float, before: float) -> float:
        """Return the velocity in the next step, if that of the last one was `before`."""
        wanted = min(max(wanted, self.low), self.high)
        return min(max(wanted, before + self.slowest * STEP_S), before + self.fastest * STEP_S)


class DiffDrive(Controller):
    """Follows `cmd_vel`; publishes `odom` and the transform to the robot."""

    interface = "hardware_interface::VelocityJointInterface"

    def __init__(
        self, node: Node, prefix: str, params: Mapping[str, Any], simulation: Simulation, lock: threading.Lock
    ) -> None:
        self.joints = (*joint_names(params.get("left_wheel")), *joint_names(params.get("right_wheel")))
        if len(self.joints) < 2:
            raise InvalidSettings("left_wheel and right_wheel must be names of joints, or lists of them")
        (self._robot,) = simulation.robots.values()
        self._simulation, self._lock = simulation, lock
        self._timeout_s = number(params.get("cmd_vel_timeout", 0.5), "cmd_vel_timeout")
        self._limits = [
            Limiter.of(mapping(mapping(params.get(axis)).get(way)), f"{axis}/{way}")
            for axis, way in (("linear", "x"), ("angular", "z"))
        ]
        self._every = _steps(params.get("publish_rate", 50.0))
        self._frames = tuple(
            str(params.get(f"{frame}_frame_id", usual)).lstrip("/")
            for frame, usual in (("odom", "odom"), ("base", "base_link"))
        )
        self._covariances = [
            _diagonal(params.get(f"{what}_covariance_diagonal", [0.0] * 6), what)
            for what in ("pose", "twist")
        ]
        self._headers = HeaderFactory()
        odometry: Any = load_message_class("nav_msgs/Odometry")
        self._tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self.start()
        super().__init__()
        self._odom = node.advertise(f"{prefix}/odom", odometry, queue_size=100)
        has_tf = params.get("enable_odom_tf", True) is not False
        self._tf = node.advertise("/tf", self._tf_class, queue_size=100) if has_tf else None
        twist: Any = load_message_class("geometry_msgs/Twist")
        commands = node.subscribe(f"{prefix}/cmd_vel", twist, self._command, queue_size=1)
        self._topics = [commands, self._odom, *([self._tf] if self._tf is not None else [])]

    def start(self) -> None:
        """Begin without commands."""
        self._wanted, self._velocity, self._commanded_s = (0.0, 0.0), (0.0, 0.0), -math.inf

    def stop(self) -> None:
        """Stop the robot."""
        self._robot.command(0.0, 0.0, self._simulation.time_s)

    def _command(self, message: Any) -> None:
        wanted = message.linear.x, message.angular.z
        if all(map(math.isfinite, wanted)):
            with self._lock:
                self._wanted, self._commanded_s = wanted, self._simulation.time_s

    def update(self, now_s: float) -> None:
        """Command the robot: within the limits, and a stop if there was no command for a while."""
        wanted = self._wanted if now_s - self._commanded_s <= self._timeout_s else (0.0, 0.0)
        forwards, turn = (
            limits.limited(each, before)
            for limits, each, before in zip(self._limits, wanted, self._velocity, strict=True)
        )
        self._velocity = forwards, turn
        self._robot.command(forwards, turn, now_s)

    def publish(self, stamp: Time, steps: int) -> None:
        """Publish the odometry and the transform."""
        if steps % self._every:
            return
        odom, base = self._frames
        if self._odom.connection_count:
            robot = self._robot
            message = odometry_message(
                self._headers.header(stamp, odom), base, robot.odometry, robot.velocity
            )
            message.pose.covariance, message.twist.covariance = self._covariances
            self._odom.publish(message)
        if self._tf is not None and self._tf.connection_count:
            transform = self._headers.transform(stamp, odom, base, self._robot.odometry)
            self._tf.publish(self._tf_class([transform]))


class JointStates(Controller):
    """Publishes `joint_states` with the joints of all drives, and `extra_joints`."""

    interface = "hardware_interface::JointStateInterface"
    joints: tuple[str, ...] = ()

    def __init__(
        self,
        node: Node,
        prefix: str,
        params: Mapping[str, Any],
        simulation: Simulation,
        wheels: Mapping[str, int],
    ) -> None:
        if "publish_rate" not in params:
            raise InvalidSettings("publish_rate must be set")
        self._every = _steps(params["publish_rate"])
        (self._robot,) = simulation.robots.values()
        self._wheels = wheels
        extra = params.get("extra_joints", [])
        if not isinstance(extra, list) or not all(
            isinstance(each, dict) and "name" in each for each in extra
        ):
            raise InvalidSettings(f"extra_joints must be a list of mappings with a name, got {extra!r}")
        self._extra = [
            (str(each["name"]), *(number(each.get(key, 0.0), f"extra_joints/{key}") for key in _STATES))
            for each in extra
        ]
        self._class: Any = load_message_class("sensor_msgs/JointState")
        super().__init__()
        self._topic = node.advertise(names.namespace(prefix) + "joint_states", self._class, queue_size=100)
        self._topics = [self._topic]

    def publish(self, stamp: Time, steps: int) -> None:
        """Publish the joint states."""
        if steps % self._every or not self._topic.connection_count:
            return
        robot, message = self._robot, self._class()
        message.header.stamp = stamp
        rows = [
            (name, robot.wheels[side], robot.wheel_speeds[side], 0.0) for name, side in self._wheels.items()
        ]
        for name, position, velocity, effort in (*rows, *self._extra):
            message.name.append(name)
            message.position.append(position)
            message.velocity.append(velocity)
            message.effort.append(effort)
        self._topic.publish(message)


def joint_names(value: object) -> list[str]:
    """Return the joints in a parameter: a name, or a list of names."""
    listed = value if isinstance(value, list) else [value]
    return [each for each in listed if isinstance(each, str) and each]


def mapping(value: object) -> Mapping[str, Any]:
    """Return a parameter that should be a mapping, or an empty one."""
    return value if isinstance(value, dict) else {}


def _steps(rate: object) -> int:
    """Return the number of steps between two messages. `rate` is in Hz; 0 and less mean every step."""
    value = number(rate, "publish_rate")
    return max(1, round(1 / (max(value, _LEAST_RATE) * STEP_S))) if value > 0 else 1


def _diagonal(value: object, what: str) -> list[float]:
    """Return a covariance with the given diagonal."""
    if not isinstance(value, list) or len(value) != 6:
        raise InvalidSettings(f"{what}_covariance_diagonal must be a list of 6 numbers, got {value!r}")
    covariance = [0.0] * 36
    covariance[::7] = [number(each, f"{what}_covariance_diagonal") for each in value]
    return covariance
