"""The turtlesim node: topics, services and parameters for a `TurtleWorld`."""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

from pipros.basics import names
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.service_server import CallFailed
from pipros_libraries.nodes.params import private
from pipros_simulation.turtlesim.picture import TurtleColor
from pipros_simulation.turtlesim.turtle import TICK_S, Pen, Teleport, Turtle, TurtleCommand
from pipros_simulation.turtlesim.world import BACKGROUND, TurtleRejected, TurtleWorld

TURTLES = 100
"""Maximum number of turtles in one turtlesim. Beyond it, `/spawn` fails."""
TELEPORTS = 1000
"""Maximum number of teleports queued for one turtle until the next tick. Beyond it, the teleport fails."""

LATE_TICKS: Final = 3
"""If the simulation is behind by more than this number of ticks, it skips the missed ticks."""

_CHANNELS: Final = ("r", "g", "b")


class TurtleEndpoints:
    """Topics and services of one turtle, from its spawning to its removal."""

    def __init__(self, node: Node, turtle: Turtle, log: logging.Logger) -> None:
        """Register the topics and services with the master. Names are relative to the node's namespace."""
        self._turtle = turtle
        self._log = log
        self._limit = TELEPORTS
        self._node = node
        self._has_warned = False
        self._pose_class: Any = load_message_class("turtlesim/Pose")
        self._color_class: Any = load_message_class("turtlesim/Color")
        name = turtle.name
        self._pose = node.advertise(f"{name}/pose", self._pose_class, queue_size=1)
        self._color = node.advertise(f"{name}/color_sensor", self._color_class, queue_size=1)
        services: dict[str, tuple[str, Callable[[Any], object]]] = {
            "set_pen": ("SetPen", self._set_pen),
            "teleport_relative": ("TeleportRelative", self._teleport_relative),
            "teleport_absolute": ("TeleportAbsolute", self._teleport_absolute),
        }
        self._services = [
            _serve(node, f"{name}/{service}", f"turtlesim/{kind}", handler)
            for service, (kind, handler) in services.items()
        ]
        twist: Any = load_message_class("geometry_msgs/Twist")
        self._commands = node.subscribe(f"{name}/cmd_vel", twist, self._command, queue_size=1)

    def publish(self, seen: TurtleColor) -> None:
        """Publish the pose and the colour that the sensor measures, if the topics have subscribers."""
        if self._pose.connection_count:
            pose = self._turtle.pose
            self._pose.publish(
                self._pose_class(pose.x, pose.y, pose.theta, pose.linear_velocity, pose.angular_velocity)
            )
        if self._color.connection_count:
            self._color.publish(self._color_class(seen.r, seen.g, seen.b))

    def close(self) -> None:
        """Unregister the topics and services."""
        self._commands.unregister()
        self._pose.unregister()
        self._color.unregister()
        for service in self._services:
            self._node.endpoints.stop_serving(service)

    def _command(self, message: Any) -> None:
        velocities = (message.linear.x, message.linear.y, message.angular.z)
        if all(map(math.isfinite, velocities)):
            self._turtle.command(TurtleCommand(*velocities, time.monotonic()))
        elif not self._has_warned:
            self._has_warned = True
            self._log.warning("[%s] ignores commands that are not finite: %s", self._turtle.name, velocities)

    def _set_pen(self, request: Any) -> None:
        if request.off:
            self._turtle.lift_pen()
        else:
            self._turtle.pen = Pen(TurtleColor(request.r, request.g, request.b), request.width)

    def _teleport_relative(self, request: Any) -> None:
        self._teleport(Teleport(True, request.linear, 0.0, request.angular))

    def _teleport_absolute(self, request: Any) -> None:
        self._teleport(Teleport(False, request.x, request.y, request.theta))

    def _teleport(self, teleport: Teleport) -> None:
        if not all(map(math.isfinite, (teleport.x, teleport.y, teleport.theta))):
            self._log.error("[%s] cannot be teleported to %s", self._turtle.name, teleport)
            raise CallFailed
        if self._turtle.teleports_waiting >= self._limit:
            self._log.error("too many teleports: %s", f"the limit is {self._limit}")
            raise CallFailed
        self._turtle.teleport(teleport)


class Turtlesim:
    """A ROS node that runs a world of turtles.

    Service handlers run in threads. `_change` is held while turtles and their registrations change; `lock` is
    held while the world changes or ticks, but not during registrations.

    Attributes:
        world: the world; hold `lock` while using it.
    """

    def __init__(self, node: Node, log: logging.Logger) -> None:
        self.lock = threading.Lock()
        self._node = node
        self._log = log
        self._change = threading.Lock()
        self._endpoints: dict[Turtle, TurtleEndpoints] = {}
        for channel, value in zip(_CHANNELS, (BACKGROUND.r, BACKGROUND.g, BACKGROUND.b), strict=True):
            if not node.params.has(f"~background_{channel}"):
                node.params.set(f"~background_{channel}", value)
        log.info("Starting turtlesim with node name %s", node.name)
        self.world = TurtleWorld(
            log,
            background=self._background(),
            namespace=node.namespace,
            limit=TURTLES,
        )
        for turtle in self.world.turtles.values():
            self._endpoints[turtle] = TurtleEndpoints(node, turtle, log)
        _serve(node, "clear", "std_srvs/Empty", self._clear)
        _serve(node, "reset", "std_srvs/Empty", self._reset)
        _serve(node, "spawn", "turtlesim/Spawn", self._spawn)
        _serve(node, "kill", "turtlesim/Kill", self._kill)

    def run(self) -> None:
        """Run the world until the node is shut down."""
        due_s = time.monotonic()
        while not self._node.wait_for_shutdown(max(0.0, due_s - time.monotonic())):
            self.tick()
            due_s += TICK_S
            if time.monotonic() - due_s > LATE_TICKS * TICK_S:
                due_s = time.monotonic()

    def tick(self) -> None:
        """Move the turtles and publish their poses and colours."""
        with self.lock:
            seen = self.world.tick(time.monotonic())
        for turtle, color in seen:
            endpoints = self._endpoints.get(turtle)
            if endpoints is not None:
                endpoints.publish(color)

    def _background(self) -> TurtleColor:
        """Return the background colour from the parameters, with defaults for missing or invalid channels."""
        return TurtleColor(*(self._channel(channel) for channel in _CHANNELS))

    def _channel(self, channel: str) -> int:
        return private(self._node, f"background_{channel}", int(getattr(BACKGROUND, channel))) & 0xFF

    def _clear(self, _: Any) -> None:
        with self._change:
            background = self._background()
            with self.lock:
                self.world.clear(background)

    def _reset(self, _: Any) -> None:
        with self._change:
            background = self._background()
            with self.lock:
                first = self.world.reset(background)
            before, self._endpoints = self._endpoints, {}
            for endpoints in before.values():
                endpoints.close()
            self._endpoints[first] = TurtleEndpoints(self._node, first, self._log)

    def _spawn(self, request: Any) -> Any:
        with self._change, self._failures():
            self._check_name(request.name)
            if not all(map(math.isfinite, (request.x, request.y, request.theta))):
                raise TurtleRejected(f"No turtle can be at {request.x}, {request.y}, {request.theta}")
            with self.lock:
                turtle = self.world.spawn(request.name, request.x, request.y, request.theta)
            self._endpoints[turtle] = TurtleEndpoints(self._node, turtle, self._log)
            return {"name": turtle.name}

    def _check_name(self, name: str) -> None:
        """Raise `TurtleRejected` if a name is not legal in topic names, or belongs to another turtle."""
        if name and (not names.is_legal(name) or names.is_private(name) or names.canonicalize(name) != name):
            raise TurtleRejected(f"[{name}] is not a valid name for a turtle")
        taken = {self._node.resolve(turtle) for turtle in self.world.turtles if turtle != name}
        if name and self._node.resolve(name) in taken:
            raise TurtleRejected(f"[{name}] is the name of another turtle")

    def _kill(self, request: Any) -> None:
        with self._change, self._failures():
            with self.lock:
                turtle = self.world.kill(request.name)
            self._endpoints.pop(turtle).close()

    @contextlib.contextmanager
    def _failures(self) -> Iterator[None]:
        """Log the error if the world rejects a request within the context, and make the service call fail."""
        try:
            yield
        except TurtleRejected as error:
            self._log.error("%s", error)
            raise CallFailed from None


def _serve(node: Node, name: str, kind: str, handler: Callable[[Any], Any]) -> Any:
    """Serve a service whose handler returns the fields of the response, or None."""
    service: Any = load_service_class(kind)
    return node.serve(name, service, lambda request: service._response_class(**(handler(request) or {})))
