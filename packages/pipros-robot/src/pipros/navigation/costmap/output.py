"""Publish a costmap's costs, completely or in parts, and the robot's footprint."""

from __future__ import annotations

from typing import Any

from pipros.libraries.nodes.params import search_upwards
from pipros.libraries.nodes.wiring import advertise, stamped
from pipros.msg import load_message_class
from pipros.navigation.costmap.core import CostmapCore
from pipros.navigation.costmap.grid import Points
from pipros.navigation.costmap.layered import CellRectangle
from pipros.node.clock import stamp

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
        footprint = f"{namespace}/{[*topics, 'footprint'][0]}"
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
        is_due = not 0 <= now_ns - self._last_ns < self._period_ns
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
