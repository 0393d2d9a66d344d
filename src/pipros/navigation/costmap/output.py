"""What a costmap publishes: its costs, whole or in parts, and the robot's footprint."""

from __future__ import annotations

from typing import Any

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.navigation.costmap.grid import Points
from pipros.navigation.costmap.host import Host
from pipros.navigation.costmap.layered import Window
from pipros.navigation.parameters import search_upwards
from pipros.node import Node


class CostmapOutput:
    """Publishes a costmap: `costmap`, `costmap_updates` and `footprint`.

    Every new subscriber gets the whole map. Afterwards only the parts that were computed since the last
    publication are sent, unless the size or place of the map changes.
    """

    def __init__(self, node: Node, costmap: Host, *, always_full: bool) -> None:
        self._node, self._costmap, self._always_full = node, costmap, always_full
        self._period_ns = 0
        self._last_ns = 0
        self._sent: tuple[float, ...] = ()
        self._window: Window | None = None
        self._grid: Any = load_message_class("nav_msgs/OccupancyGrid")
        self._update: Any = load_message_class("map_msgs/OccupancyGridUpdate")
        self._polygon: Any = load_message_class("geometry_msgs/PolygonStamped")
        self._point: Any = load_message_class("geometry_msgs/Point32")
        namespace = costmap.namespace
        topic = search_upwards(node, namespace, "published_footprint_topic")
        if not isinstance(topic, str):
            topic = search_upwards(node, namespace, "published_footprint")
        self._footprints = node.advertise(
            f"{namespace}/{topic if isinstance(topic, str) else 'footprint'}", self._polygon, queue_size=1
        )
        self._maps = node.advertise(f"{namespace}/costmap", self._grid, queue_size=1)
        self._updates = node.advertise(f"{namespace}/costmap_updates", self._update, queue_size=1)
        self._maps.publication.listeners.append(self)

    @property
    def footprint_topic(self) -> str:
        """The topic on which the footprint is published."""
        return self._footprints.topic

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:  # noqa: ARG002
        """Send the map to a new subscriber."""
        peer_publish(self._whole())

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Do nothing."""

    def set_frequency(self, frequency: float) -> None:
        """Set the publications per second; 0 for none."""
        self._period_ns = round(1e9 / frequency) if frequency > 0 else 0

    def note(self, window: Window) -> None:
        """Note cells that were computed. The caller holds the costmap's lock."""
        if window.x0 < window.xn:
            old = self._window or window
            self._window = Window(
                min(old.x0, window.x0), min(old.y0, window.y0), max(old.xn, window.xn), max(old.yn, window.yn)
            )

    def publish_if_due(self, now_ns: int) -> None:
        """Publish the map, or what changed in it, if it is time and there is a subscriber."""
        is_due = not 0 <= now_ns - self._last_ns < self._period_ns
        if self._period_ns and is_due and self._costmap.is_initialized:
            self._last_ns = now_ns
            self._publish()

    def _publish(self) -> None:
        if not self._maps.connection_count:
            return
        with self._costmap.lock:
            window, self._window = self._window, None
            is_whole = self._always_full or self._sent != self._costmap.layered.grid.geometry
            message = self._whole() if is_whole else self._part(window) if window is not None else None
        if message is not None:
            (self._maps if is_whole else self._updates).publish(message)

    def _whole(self) -> Any:
        with self._costmap.lock:
            grid = self._costmap.layered.grid
            message = self._grid()
            self._stamp(message)
            message.info.resolution = grid.resolution
            message.info.width, message.info.height = grid.width, grid.height
            x, y = grid.cell_to_world(0, 0)
            position = message.info.origin.position
            position.x, position.y = x - grid.resolution / 2, y - grid.resolution / 2
            message.info.origin.orientation.w = 1.0
            message.data = memoryview(grid.published()).cast("b")
            self._sent = grid.geometry
        return message

    def _part(self, window: Window) -> Any:
        message = self._update(x=window.x0, y=window.y0)
        self._stamp(message)
        message.width, message.height = window.xn - window.x0, window.yn - window.y0
        message.data = memoryview(self._costmap.layered.grid.published(window.slices)).cast("b")
        return message

    def publish_footprint(self, corners: Points) -> None:
        """Publish the robot's outline in the global frame."""
        message = self._polygon()
        self._stamp(message)
        message.polygon.points = [self._point(x, y, 0.0) for x, y in corners]
        self._footprints.publish(message)

    def _stamp(self, message: Any) -> None:
        message.header.frame_id = self._costmap.global_frame
        message.header.stamp = Time(*divmod(self._node.clock.now_ns(), 1_000_000_000))
