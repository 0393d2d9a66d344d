"""A costmap with its topics, transforms, parameters and layers, like costmap_2d's Costmap2DROS."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.basics.intervals import elapsed
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.inputs import inside
from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters, search_upwards
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.transforms.errors import TransformException
from pipros_robot.navigation.costmap import footprint
from pipros_robot.navigation.costmap.core import CostmapCore
from pipros_robot.navigation.costmap.grid import Points
from pipros_robot.navigation.costmap.layered import CellRectangle, Pose2D
from pipros_robot.navigation.costmap.layers import add_layers
from pipros_robot.navigation.limits import NavigationLimits
from pipros_robot.navigation.plane import MOST, flat

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
                value = PrivateParameters({"robot_radius": radius}, f"{self.namespace}/").number(
                    "robot_radius", 1.234
                )
                self.node.params.set(f"{self.namespace}/robot_radius", value)
        topic = search_upwards(self.node, self.namespace, "footprint_topic")
        name = inside(self.node, self.namespace, topic if isinstance(topic, str) else "footprint")
        if name != self._output.footprint_topic:
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
            names = "origin_x", "origin_y", "footprint_padding"
            if huge := [name for name in names if not abs(values[name]) <= MOST]:
                self._refuse(f"{' and '.join(huge)} must be from -{MOST:g} to {MOST:g} m")
            else:
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
        if not (min(width, height) >= 1 and width * height <= limit):
            size = f"{values['width']} X {values['height']} m, {resolution} m per cell"
            self._refuse(f"width and height, by resolution, must make 1 to {limit} cells, got {size}")
            return
        self.layered.resize(int(width), int(height), resolution, values["origin_x"], values["origin_y"])

    def _refuse(self, rule: str) -> None:
        """Raise an error at the start, when there are no values to keep, and report it later."""
        if not self.grid.costs.size:
            raise InvalidParameter(f"{self.namespace}: {rule}")
        self.log.error("%s: %s: size, place and padding of the map stay as they are", self.name, rule)

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
            self._change_period = self._schedule.every(1 / frequency, self._on_time, name="Map update loop")
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

    @property
    def silent_topics(self) -> list[str]:
        """The topics of sensors from which nothing has arrived so far."""
        return [each.topic for each in self._inputs if not each.has_data]

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


_NOTHING = CellRectangle(0, 0, 0, 0)


class CostmapOutput:
    """Publishes a costmap: `costmap`, `costmap_updates` and `footprint`.

    Every new subscriber receives the whole map. Afterwards, only the area that was recomputed since the last
    publication is sent, unless `always_full` is true, or the map's size or position changes.
    """

    def __init__(self, costmap: CostmapCore, *, always_full: bool) -> None:
        self._costmap, self._always_full = costmap, always_full
        self._period_ns = self._last_ns = 0
        self._sent: tuple[float, ...] = ()
        self._window = _NOTHING
        node, namespace = costmap.node, costmap.namespace
        keys = "published_footprint_topic", "published_footprint"
        topics = [name for key in keys if isinstance(name := search_upwards(node, namespace, key), str)]
        footprint = inside(node, namespace, [*topics, "footprint"][0])
        self._footprints = advertise(node, footprint, "geometry_msgs/PolygonStamped")
        self.footprint_topic: str = self._footprints.topic
        self._maps = advertise(node, f"{namespace}/costmap", "nav_msgs/OccupancyGrid")
        self._updates = advertise(node, f"{namespace}/costmap_updates", "map_msgs/OccupancyGridUpdate")
        self._maps.publication.listeners.append(self)

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:  # noqa: ARG002
        """Send the map to a new subscriber."""
        peer_publish(self._whole())

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Do nothing when a subscriber leaves."""

    def set_frequency(self, frequency: float) -> None:
        """Set the publishing rate in Hz; 0 disables publishing."""
        self._period_ns = round(1e9 / frequency) if frequency > 0 else 0

    def note(self, window: CellRectangle) -> None:
        """Record cells that were recomputed. The caller holds the costmap's lock."""
        self._window = self._window.united(window)

    def publish_if_due(self, now_ns: int) -> None:
        """Publish the map or its changes if a publication is due and there are subscribers."""
        is_due = elapsed(now_ns, self._last_ns) >= self._period_ns
        if not (self._period_ns and is_due and self._costmap.is_initialized):
            return
        self._last_ns = now_ns
        if not self._maps.connection_count:
            return
        with self._costmap.lock:
            window, self._window = self._window, _NOTHING
            is_whole = self._always_full or self._sent != self._costmap.grid.geometry
            message = self._whole() if is_whole else self._part(window)
        if is_whole or window != _NOTHING:
            (self._maps if is_whole else self._updates).publish(message)

    def _whole(self) -> Any:
        with self._costmap.lock:
            grid, message = self._costmap.grid, self._stamped("nav_msgs/OccupancyGrid")
            message.info.resolution = grid.resolution
            message.info.width, message.info.height = grid.width, grid.height
            x, y = grid.cell_to_world(0, 0)
            position = message.info.origin.position
            position.x, position.y = x - grid.resolution / 2, y - grid.resolution / 2
            message.info.origin.orientation.w = 1.0
            message.data = memoryview(grid.published()).cast("b")
            self._sent = grid.geometry
        return message

    def _part(self, window: CellRectangle) -> Any:
        message = self._stamped("map_msgs/OccupancyGridUpdate", x=window.x0, y=window.y0)
        message.width, message.height = window.xn - window.x0, window.yn - window.y0
        message.data = memoryview(self._costmap.grid.published(window.slices)).cast("b")
        return message

    def publish_footprint(self, corners: Points) -> None:
        """Publish the robot's outline in the global frame."""
        point: Any = load_message_class("geometry_msgs/Point32")
        message = self._stamped("geometry_msgs/PolygonStamped")
        message.polygon.points = [point(x, y, 0.0) for x, y in corners]
        self._footprints.publish(message)

    def _stamped(self, kind: str, **fields: Any) -> Any:
        return stamped(kind, self._costmap.global_frame, stamp(self._costmap.node.clock), **fields)
