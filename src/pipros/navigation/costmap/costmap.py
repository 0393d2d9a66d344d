"""A costmap with its topics, transforms, parameters and layers: what costmap_2d calls Costmap2DROS."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.basics.errors import Interrupted
from pipros.basics.throttle import Throttle
from pipros.libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros.libraries.transforms.errors import TransformException
from pipros.navigation.costmap import footprint
from pipros.navigation.costmap.grid import CostGrid, Points
from pipros.navigation.costmap.layered import LayeredCostmap, Pose2D
from pipros.navigation.costmap.layers import add_layers
from pipros.navigation.costmap.output import CostmapOutput
from pipros.navigation.costmap.sensor_input import SensorInput
from pipros.navigation.frames import Frames
from pipros.navigation.limits import NavigationLimits
from pipros.navigation.parameters import InvalidParameter, Parameters, read_parameters, search_upwards
from pipros.navigation.plane import flat
from pipros.navigation.programs import run_node
from pipros.navigation.schedule import Schedule
from pipros.navigation.wiring import subscribe
from pipros.node import Node

_WAIT_S: Final = 0.1
_WARNING_S: Final = 5.0

SETTINGS: Final = (
    Setting("transform_tolerance", 0.3, 0, 10, "Age of the robot's pose in seconds, at most"),
    Setting("update_frequency", 5.0, 0, 100, "Updates per second; 0 for none"),
    Setting("publish_frequency", 0.0, 0, 100, "Publications per second; 0 for none"),
    Setting("width", 10, 0, None, "Width in metres"),
    Setting("height", 10, 0, None, "Height in metres"),
    Setting("resolution", 0.05, 0, 50, "Metres per cell"),
    Setting("origin_x", 0.0, description="The left edge in the global frame, in metres"),
    Setting("origin_y", 0.0, description="The lower edge in the global frame, in metres"),
    Setting("footprint", "[]", description="Corners of the robot around its centre: [[x1, y1], [x2, y2], …]"),
    Setting("robot_radius", 0.46, 0, 10, "Radius of a round robot in metres, if there is no footprint"),
    Setting("footprint_padding", 0.01, description="Distance by which the footprint is widened, in metres"),
)


class Costmap:
    """The costmap of a node, in the namespace `~name`.

    Attributes:
        name: the last part of its namespace, such as `global_costmap`.
        global_frame, base_frame: the frames of the map and of the robot.
        layered: the costs and the layers. Hold `lock` while you read or change anything in it.
        is_initialized: whether there was an update since the start.
        inputs: the subscriptions of all layers to sensors.
    """

    def __init__(
        self, node: Node, log: logging.Logger, frames: Frames, schedule: Schedule, name: str
    ) -> None:
        """Wait for the robot's pose and for static maps, without a limit, then start the updates.

        Raises:
            InvalidParameter: a parameter has a value with which the costmap cannot run.
            Interrupted: the node was shut down while it waited.
        """
        self.node, self.log, self.frames, self._schedule = node, log, frames, schedule
        self.name, self.namespace = name, f"~{name}"
        self.lock = threading.RLock()
        given = read_parameters(node, self.namespace)
        self.global_frame = given.text("global_frame", "map").lstrip("/")
        self.base_frame = given.text("robot_base_frame", "base_link").lstrip("/")
        if not self.global_frame or not self.base_frame:
            raise InvalidParameter(f"{self.namespace}: global_frame and robot_base_frame must not be empty")
        self.is_initialized = False
        self._is_stopped = False
        self._tolerance_s = 0.3
        self._padding = 0.01
        self._unpadded: Points = []
        self._outline: tuple[Value, Value] | None = None
        self._change_period: Callable[[float], None] | None = None
        self._throttle = Throttle(log, 1.0)
        self.wait_until(
            lambda: frames.buffer.can_transform(self.global_frame, self.base_frame, 0) is None,
            f"the transform from {self.base_frame} to {self.global_frame}",
        )
        self.layered = LayeredCostmap(
            is_rolling=given.boolean("rolling_window", False),
            tracks_unknown=given.boolean("track_unknown_space", False),
        )
        self._output = CostmapOutput(self, always_full=given.boolean("always_send_full_costmap", False))
        self.inputs: list[SensorInput] = []
        add_layers(self)
        self._connect_footprint()
        self.settings = Reconfigurable(node, self.namespace, SETTINGS, self._apply)

    @property
    def grid(self) -> CostGrid:
        """The combined costs. Hold `lock` while you use them."""
        return self.layered.grid

    @property
    def footprint(self) -> Points:
        """The padded outline of the robot."""
        return self.layered.footprint

    @property
    def is_current(self) -> bool:
        """Whether the data of all layers is recent enough to drive by."""
        return self.layered.is_current

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition, with a warning every 5 seconds.

        Raises:
            Interrupted: the node was shut down meanwhile.
        """
        warned_s = time.monotonic()
        while not condition():
            if self.node.is_ending or self.node.wait_for_shutdown(_WAIT_S):
                raise Interrupted(f"the node was shut down while {self.name} waited for {what}")
            if time.monotonic() - warned_s > _WARNING_S:
                warned_s = time.monotonic()
                self.log.warning("%s waits for %s", self.name, what)

    def warn(self, text: str, *values: Any) -> None:
        """Log a warning, at most one a second with the same text, before its values are inserted."""
        self._throttle.warning(f"{self.name}: {text}", *values)

    # -- parameters --------------------------------------------------------------

    def _connect_footprint(self) -> None:
        found = search_upwards(self.node, self.namespace, "footprint")
        if isinstance(found, list) or (isinstance(found, str) and found not in ("", "[]")):
            corners = footprint.from_parameter(found, f"{self.namespace}/footprint")
            self.node.params.set(f"{self.namespace}/footprint", footprint.as_text(corners))
        else:
            radius = search_upwards(self.node, self.namespace, "robot_radius")
            if radius is not None:
                value = Parameters({"robot_radius": radius}).number("robot_radius", 1.234)
                self.node.params.set(f"{self.namespace}/robot_radius", value)
        topic = search_upwards(self.node, self.namespace, "footprint_topic")
        name = f"{self.namespace}/{topic if isinstance(topic, str) else 'footprint'}"
        if self.node.resolve(name) != self._output.footprint_topic:
            subscribe(self.node, name, "geometry_msgs/Polygon", self._on_footprint)

    def _on_footprint(self, message: Any) -> None:
        self._try_footprint([[point.x, point.y] for point in message.points])

    def _try_footprint(self, corners: Any) -> None:
        try:
            self.set_footprint(footprint.from_parameter(corners, f"{self.namespace}/footprint"))
        except InvalidParameter as error:
            self.log.error("%s", error)

    def set_footprint(self, unpadded: Points) -> None:
        """Set the outline of the robot, which is padded by `footprint_padding`."""
        with self.lock:
            self._unpadded = unpadded
            self.layered.set_footprint(footprint.padded(unpadded, self._padding))

    def _apply(self, values: Mapping[str, Any], _: int) -> None:
        with self.lock:
            self._tolerance_s = values["transform_tolerance"]
            self._output.set_frequency(values["publish_frequency"])
            self._resize(values)
            if values["footprint_padding"] != self._padding:
                self._padding = values["footprint_padding"]
                self.set_footprint(self._unpadded)
            self._apply_footprint(values["footprint"], values["robot_radius"])
        self._set_frequency(values["update_frequency"])

    def _resize(self, values: Mapping[str, Any]) -> None:
        resolution = values["resolution"]
        if self.layered.is_size_locked:
            return
        width, height = (values[name] / resolution if resolution else 0.0 for name in ("width", "height"))
        limit = self.node.limits.of(NavigationLimits).costmap_cells
        if resolution <= 0 or width * height > limit:
            self.log.error(
                "%s: %s X %s m with %s m per cell are not possible: there must be at most %d cells",
                self.name, values["width"], values["height"], resolution, limit,
            )  # fmt: skip
            return
        self.layered.resize(int(width), int(height), resolution, values["origin_x"], values["origin_y"])

    def _apply_footprint(self, text: str, radius: float) -> None:
        if (text, radius) == self._outline:
            return
        self._outline = text, radius
        if text in ("", "[]"):
            self.set_footprint(footprint.circle(radius))
        else:
            self._try_footprint(text)

    def _set_frequency(self, frequency: float) -> None:
        self._is_off = frequency <= 0
        if self._is_off:
            return
        if self._change_period is None:
            self._change_period = self._schedule.every(1 / frequency, self._on_time)
        else:
            self._change_period(1 / frequency)

    # -- updates -----------------------------------------------------------------

    def robot_pose(self) -> Pose2D | None:
        """Return the robot's pose in the global frame. Warn and return None if it is unknown or too old."""
        now_ns, buffer = self.node.clock.now_ns(), self.frames.buffer
        try:
            is_known = now_ns and buffer.can_transform(self.global_frame, self.base_frame, now_ns) is None
            stamp_ns, pose = buffer.lookup(self.global_frame, self.base_frame, now_ns if is_known else 0)
        except TransformException as error:
            self.warn("the robot's pose is unknown: %s", error)
            return None
        age_s, limit_s = (now_ns - stamp_ns) / 1e9 if stamp_ns else 0.0, self._tolerance_s
        if age_s > limit_s:
            text = "the robot's pose is %.3f s old, more than transform_tolerance, %s s"
            self.warn(text, age_s, limit_s)
            return None
        return Pose2D(*flat(pose))

    def _on_time(self) -> None:
        if not (self._is_stopped or self._is_off):
            self.update()
        self._output.publish_if_due(self.node.clock.now_ns())

    def update(self) -> bool:
        """Compute the costs at the robot's pose. Return False if that is unknown."""
        robot = self.robot_pose()
        if robot is None:
            return False
        with self.lock:
            self.layered.update(robot)
            if self.layered.window is not None:
                self._output.note(self.layered.window)
            corners = footprint.placed(self.footprint, *robot)
            self.is_initialized = True
        self._output.publish_footprint(corners)
        return True

    def start(self) -> None:
        """Receive sensors again, and continue the updates."""
        self._set_active(is_active=True)

    def stop(self) -> None:
        """Stop the updates, and ignore sensors."""
        self._set_active(is_active=False)
        self.is_initialized = False

    def _set_active(self, *, is_active: bool) -> None:
        self._is_stopped = not is_active
        for each in self.inputs:
            each.is_active = is_active

    def reset_layers(self) -> None:
        """Forget what was measured: all costs are set back, and computed again in the next update."""
        with self.lock:
            self.grid.costs[...] = self.grid.default
            for layer in self.layered.layers:
                layer.reset()


def main() -> int:
    """Run `costmap_2d_node`: one costmap, in the namespace `~costmap`. Return 1 if a parameter is invalid."""
    return run_node(
        "costmap_node",
        "costmap_2d",
        lambda node, log, schedule: Costmap(node, log, Frames(node, log), schedule, "costmap"),
    )
