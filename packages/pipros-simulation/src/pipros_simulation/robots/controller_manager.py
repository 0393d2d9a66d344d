"""The services of controller_manager, for a simulated base; see `controllers` for what they load."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_simulation.robots.controllers import Controller, DiffDrive, JointStates, joint_names, mapping
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.robot_endpoints import serve
from pipros_simulation.robots.simulation import Simulation

BASE_CLASS: Final = "controller_interface::ControllerBase"
MAX_CONTROLLERS: Final = 100
STRICT: Final = 2
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
            params = mapping(self._node.params.get(prefix)) if self._node.params.has(prefix) else {}
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
                each.controller.stop()
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
