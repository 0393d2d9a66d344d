"""A costmap with its topics, transforms, parameters and layers, like costmap_2d's Costmap2DROS."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.libraries.nodes.frames import Frames
from pipros.libraries.nodes.params import InvalidParameter, PrivateParameters, search_upwards
from pipros.libraries.nodes.program import run_node
from pipros.libraries.nodes.schedule import Schedule
from pipros.libraries.nodes.wiring import subscribe
from pipros.libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros.libraries.transforms.errors import TransformException
from pipros.navigation.costmap import footprint
from pipros.navigation.costmap.core import CostmapCore
from pipros.navigation.costmap.grid import Points
from pipros.navigation.costmap.layered import Pose2D
from pipros.navigation.costmap.layers import add_layers
from pipros.navigation.costmap.output import CostmapOutput
from pipros.navigation.limits import NavigationLimits
from pipros.navigation.plane import flat
from pipros.node import Node

_MOST_AGE_S: Final = 2.0
"""Maximum age of costs by which the robot drives, unless two update periods are longer."""

SETTINGS: Final = (
    Setting("transform_tolerance", 0.3, 0, 10, "Maximum age of the robot's pose, in seconds"),
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


class Costmap(CostmapCore):
    """The costmap of a node, in the namespace `~name`."""

    def __init__(
        self, node: Node, log: logging.Logger, frames: Frames, schedule: Schedule, name: str
    ) -> None:
        """Wait for the robot's pose and for static maps without a time limit, then start the updates.

        Raises:
            InvalidParameter: a parameter has an invalid value.
            Interrupted: the node was shut down while waiting.
        """
        super().__init__(node, log, frames, name)
        self._schedule = schedule
        self._is_stopped, self._is_off = False, True
        self._updated_ns, self._most_age_ns = 0, 0.0
        self._tolerance_s = 0.3
        self._padding = 0.01
        self._unpadded: Points = []
        self._outline: tuple[Value, Value] | None = None
        self._change_period: Callable[[float], None] | None = None
        self._output = CostmapOutput(self, always_full=self.given.boolean("always_send_full_costmap", False))
        self._inputs = add_layers(self)
        self._connect_footprint()
        self.settings = Reconfigurable(node, self.namespace, SETTINGS, self._apply)

    # -- parameters --------------------------------------------------------------

    def _connect_footprint(self) -> None:
        found = search_upwards(self.node, self.namespace, "footprint")
        if isinstance(found, list) or (isinstance(found, str) and found not in ("", "[]")):
            corners = footprint.from_parameter(found, f"{self.namespace}/footprint")
            self.node.params.set(f"{self.namespace}/footprint", footprint.as_text(corners))
        else:
            radius = search_upwards(self.node, self.namespace, "robot_radius")
            if radius is not None:
                value = PrivateParameters({"robot_radius": radius}).number("robot_radius", 1.234)
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
        """Set the outline of the robot. It is padded by `footprint_padding`."""
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
                "%s: resolution must be > 0, with at most %d cells in the map, got %s X %s m, %s m per cell",
                self.name, limit, values["width"], values["height"], resolution,
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
        self._most_age_ns = max(_MOST_AGE_S, 2 / frequency) * 1e9
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

    @property
    def is_current(self) -> bool:
        """Whether the sensor data is recent enough for driving, and the costs contain it."""
        age_ns = self.node.clock.now_ns() - self._updated_ns
        return super().is_current and not self._is_off and 0 <= age_ns <= self._most_age_ns

    def _on_time(self) -> None:
        if not (self._is_stopped or self._is_off):
            self.update()
        self._output.publish_if_due(self.node.clock.now_ns())

    def update(self) -> bool:
        """Update the costs for the robot's current pose. Return False if the pose is unknown or too old."""
        robot = self.robot_pose()
        if robot is None:
            return False
        with self.lock:
            self.layered.update(robot)
            if self.layered.window is not None:
                self._output.note(self.layered.window)
            corners = footprint.placed(self.footprint, *robot)
            self.is_initialized, self._updated_ns = True, self.node.clock.now_ns()
        self._output.publish_footprint(corners)
        return True

    def start(self) -> None:
        """Resume the updates, and process the messages of the sensors again."""
        self._set_active(is_active=True)

    def stop(self) -> None:
        """Stop the updates, and ignore the sensors."""
        self._set_active(is_active=False)
        self.is_initialized = False

    def _set_active(self, *, is_active: bool) -> None:
        self._is_stopped = not is_active
        for each in self._inputs:
            each.is_active = is_active

    def reset_layers(self) -> None:
        """Discard all measurements and reset the costs. The next update recomputes them."""
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
