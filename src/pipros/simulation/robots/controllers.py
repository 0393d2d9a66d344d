"""A simulated base behind a controller manager: the services of controller_manager, and two controllers.

`diff_drive_controller/DiffDriveController` and `joint_state_controller/JointStateController` have the topics
and parameters of ros_control's (http://wiki.ros.org/diff_drive_controller), on the robot of a `Simulation`.
The geometry of the wheels is the robot's, so the parameters that describe it have no effect.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.simulation.robots.errors import InvalidSettings
from pipros.simulation.robots.robot_endpoints import Headers, odometry_message, serve
from pipros.simulation.robots.settings import number
from pipros.simulation.robots.simulation import STEP_S, Simulation

BASE_CLASS: Final = "controller_interface::ControllerBase"
MAX_CONTROLLERS: Final = 100
STRICT: Final = 2


class Controller(Protocol):
    """A controller that is loaded.

    Attributes:
        interface: the hardware interface that it uses.
        joints: the joints that no other controller may use while it runs.
    """

    interface: str
    joints: tuple[str, ...]

    def start(self) -> None:
        """Begin without commands."""

    def update(self, now_s: float) -> None:
        """Command the robot before a step."""

    def publish(self, stamp: Time, steps: int) -> None:
        """Publish measurements after a step."""

    def close(self) -> None:
        """Unregister all topics."""


@dataclass(frozen=True, slots=True)
class Limiter:
    """Limits of a velocity, in m/s and m/s² or in rad/s and rad/s²."""

    low: float = -math.inf
    high: float = math.inf
    slowest: float = -math.inf
    fastest: float = math.inf

    @classmethod
    def of(cls, params: Mapping[str, Any], where: str) -> Limiter:
        """Read the parameters `has_velocity_limits`, `max_velocity`, …"""
        found = []
        for quantity in ("velocity", "acceleration"):
            low, high = -math.inf, math.inf
            if params.get(f"has_{quantity}_limits") is True:
                high = number(params.get(f"max_{quantity}"), f"{where}/max_{quantity}")
                low = number(params.get(f"min_{quantity}", -high), f"{where}/min_{quantity}")
            found += [low, high]
        return cls(*found)

    def limited(self, wanted: float, before: float) -> float:
        """Return the velocity in the next step, if that of the last one was `before`."""
        wanted = min(max(wanted, self.low), self.high)
        return min(max(wanted, before + self.slowest * STEP_S), before + self.fastest * STEP_S)


class DiffDrive:
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
            Limiter.of(_mapping(_mapping(params.get(axis)).get(way)), f"{axis}/{way}")
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
        self._headers = Headers()
        odometry: Any = load_message_class("nav_msgs/Odometry")
        self._tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self.start()
        self._odom = node.advertise(f"{prefix}/odom", odometry, queue_size=100)
        has_tf = params.get("enable_odom_tf", True) is not False
        self._tf = node.advertise("/tf", self._tf_class, queue_size=100) if has_tf else None
        twist: Any = load_message_class("geometry_msgs/Twist")
        self._commands = node.subscribe(f"{prefix}/cmd_vel", twist, self._command, queue_size=1)

    def start(self) -> None:
        """Begin without commands."""
        self._wanted, self._velocity, self._commanded_s = (0.0, 0.0), (0.0, 0.0), -math.inf

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
        """Publish the odometry, as often as `publish_rate` says."""
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

    def close(self) -> None:
        """Unregister all topics."""
        self._commands.unregister()
        self._odom.unregister()
        if self._tf is not None:
            self._tf.unregister()


class JointStates:
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
        self._topic = node.advertise(names.namespace(prefix) + "joint_states", self._class, queue_size=100)

    def start(self) -> None:
        """Do nothing."""

    def update(self, now_s: float) -> None:
        """Do nothing."""

    def publish(self, stamp: Time, steps: int) -> None:
        """Publish the joint states, as often as `publish_rate` says."""
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

    def close(self) -> None:
        """Unregister the topic."""
        self._topic.unregister()


_STATES: Final = ("position", "velocity", "effort")
TYPES: Final = (
    "diff_drive_controller/DiffDriveController",
    "joint_state_controller/JointStateController",
)


@dataclass(slots=True)
class _Loaded:
    name: str
    kind: str
    controller: Controller
    state: str = "initialized"


class ControllerManager:
    """Loads, starts and stops the controllers of the only robot of a simulation."""

    def __init__(
        self,
        node: Node,
        namespace: str,
        simulation: Simulation,
        lock: threading.Lock,
        wheels: tuple[str, str],
    ) -> None:
        """Offer the services `controller_manager/…` in a namespace.

        Args:
            lock: held while the simulation is used. `update` and `publish` are called with the lock held.
            wheels: the joints of the robot before a drive with other names is loaded.

        Raises:
            InvalidSettings: the simulation has several robots.
        """
        if len(simulation.robots) != 1:
            raise InvalidSettings(f"controllers need exactly one robot, got {len(simulation.robots)}")
        self._node, self._simulation, self._lock = node, simulation, lock
        self._namespace = names.make_global_namespace(namespace)
        self._loaded: dict[str, _Loaded] = {}
        self._usual_wheels, self._wheels = wheels, dict(zip(wheels, (0, 1), strict=True))
        self._changing = threading.Lock()  # held during a service call, so that no two of them mix
        for service, kind, handler in (
            ("list_controllers", "ListControllers", self._list),
            ("list_controller_types", "ListControllerTypes", self._list_types),
            ("load_controller", "LoadController", self._load),
            ("unload_controller", "UnloadController", self._unload),
            ("switch_controller", "SwitchController", self._switch),
            ("reload_controller_libraries", "ReloadControllerLibraries", self._reload),
        ):
            serve(
                node,
                f"{self._namespace}controller_manager/{service}",
                f"controller_manager_msgs/{kind}",
                self._guarded(handler),
            )

    def update(self) -> None:
        """Let the running controllers command the robot, before a step."""
        for each in self._running():
            each.controller.update(self._simulation.time_s)

    def publish(self, stamp: Time) -> None:
        """Publish what the running controllers measure."""
        for each in self._running():
            each.controller.publish(stamp, self._simulation.steps)

    def _running(self) -> list[_Loaded]:
        return [each for each in self._loaded.values() if each.state == "running"]

    def _guarded(self, handler: Any) -> Any:
        def handle(request: Any) -> Any:
            with self._changing:
                return handler(request)

        return handle

    # -- services --------------------------------------------------------------------

    def _list(self, _: Any) -> Any:
        state: Any = load_message_class("controller_manager_msgs/ControllerState")
        resources: Any = load_message_class("controller_manager_msgs/HardwareInterfaceResources")
        return {
            "controller": [
                state(
                    each.name,
                    each.state,
                    each.kind,
                    [resources(each.controller.interface, list(each.controller.joints))],
                )
                for each in self._loaded.values()
            ]
        }

    def _list_types(self, _: Any) -> Any:
        return {"types": list(TYPES), "base_classes": [BASE_CLASS] * len(TYPES)}

    def _load(self, request: Any) -> Any:
        prefix = self._namespace + request.name
        try:
            if request.name in self._loaded or len(self._loaded) >= MAX_CONTROLLERS:
                raise InvalidSettings(f"it is already loaded, or {MAX_CONTROLLERS} others are")
            if not request.name or not names.is_legal(request.name):
                raise InvalidSettings("this is not a name")
            params = _mapping(self._node.params.get(prefix)) if self._node.params.has(prefix) else {}
            self._loaded = {**self._loaded, request.name: self._made(request.name, prefix, params)}
        except PiprosError as error:
            self._node.log.error("cannot load the controller [%s]: %s", prefix, error)
            return {"ok": False}
        return {"ok": True}

    def _made(self, name: str, prefix: str, params: Mapping[str, Any]) -> _Loaded:
        kind = str(params.get("type", ""))
        if kind == TYPES[0]:
            drive = DiffDrive(self._node, prefix, params, self._simulation, self._lock)
            left = joint_names(params.get("left_wheel"))
            with self._lock:
                if not any(each.kind == kind for each in self._loaded.values()):
                    self._wheels.clear()
                self._wheels |= {joint: int(joint not in left) for joint in drive.joints}
            return _Loaded(name, kind, drive)
        if kind == TYPES[1]:
            return _Loaded(
                name, kind, JointStates(self._node, prefix, params, self._simulation, self._wheels)
            )
        if not kind:
            raise InvalidSettings(f"the parameter {prefix}/type is not set")
        raise InvalidSettings(f"{kind} is not simulated; only {' and '.join(TYPES)} are")

    def _unload(self, request: Any) -> Any:
        found = self._loaded.get(request.name)
        if found is None or found.state == "running":
            why = "it is not loaded" if found is None else "it is running; stop it first"
            self._node.log.error("cannot unload the controller [%s]: %s", request.name, why)
            return {"ok": False}
        self._loaded = {key: each for key, each in self._loaded.items() if each is not found}
        found.controller.close()
        return {"ok": True}

    def _switch(self, request: Any) -> Any:
        """Stop and start controllers. If that fails with `STRICT`, change nothing."""
        problems = []
        stop: list[_Loaded] = []
        start: list[_Loaded] = []
        for chosen, wanted, is_running in (
            (stop, request.stop_controllers, True),
            (start, request.start_controllers, False),
        ):
            for name in wanted:
                found = self._loaded.get(name)
                if found is None or (found.state == "running") is not is_running:
                    state = "not loaded" if found is None else found.state
                    problems.append(f"[{name}] is {state}")
                else:
                    chosen.append(found)
        used = {joint for each in self._running() if each not in stop for joint in each.controller.joints}
        for each in list(start):
            if used & set(each.controller.joints):
                problems.append(f"the joints of [{each.name}] are in use")
                start.remove(each)
            used |= set(each.controller.joints)
        if problems:
            self._node.log.error("cannot switch all controllers: %s", "; ".join(problems))
        if problems and (request.strictness == STRICT or any("in use" in each for each in problems)):
            return {"ok": False}
        with self._lock:
            for each in stop:
                each.state = "stopped"
            for each in start:
                each.controller.start()
                each.state = "running"
        return {"ok": True}

    def _reload(self, request: Any) -> Any:
        """Unload all controllers, if that is asked for; there are no libraries to reload."""
        loaded = list(self._loaded.values())
        if loaded and not request.force_kill:
            self._node.log.error("cannot reload libraries: controllers are loaded")
            return {"ok": False}
        self._loaded = {}
        for each in loaded:
            each.controller.close()
        return {"ok": True}


def joint_names(value: object) -> list[str]:
    """Return the joints in a parameter: a name, or a list of names."""
    listed = value if isinstance(value, list) else [value]
    return [each for each in listed if isinstance(each, str) and each]


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _steps(rate: object) -> int:
    """Return the number of steps between two messages. `rate` is in Hz; 0 and less mean every step."""
    value = number(rate, "publish_rate")
    return max(1, round(1 / (value * STEP_S))) if value > 0 else 1


def _diagonal(value: object, what: str) -> list[float]:
    """Return a covariance with the given diagonal."""
    if not isinstance(value, list) or len(value) != 6:
        raise InvalidSettings(f"{what}_covariance_diagonal must be a list of 6 numbers, got {value!r}")
    covariance = [0.0] * 36
    covariance[::7] = [number(each, f"{what}_covariance_diagonal") for each in value]
    return covariance
