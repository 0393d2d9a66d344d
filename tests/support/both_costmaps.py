"""Run a costmap node of pipros and the genuine one on the same inputs, and compare their cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.navigation_oracle import add_to
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")


class Received:
    """The map of one side, made of its messages."""

    def __init__(self) -> None:
        self.cells: Any = np.zeros((0, 0), np.int8)
        self.info: Any = None
        self.update_count = 0
        self.footprint: list[tuple[float, float]] = []

    def on_map(self, message: Any) -> None:
        self.info = message.info
        cells = np.array(message.data, np.int8)
        self.cells = cells.reshape(message.info.height, message.info.width).copy()

    def on_update(self, message: Any) -> None:
        part = np.array(message.data, np.int8)
        rows, columns = (
            slice(message.y, message.y + message.height),
            slice(message.x, message.x + message.width),
        )
        cells = self.cells.copy()
        cells[rows, columns] = part.reshape(message.height, message.width)
        self.cells = cells
        self.update_count += 1

    def on_footprint(self, message: Any) -> None:
        self.footprint = [(point.x, point.y) for point in message.polygon.points]

    @property
    def place(self) -> tuple[float, ...]:
        position = self.info.origin.position
        return (self.info.width, self.info.height, self.info.resolution, position.x, position.y)


def agree(ours: Any, theirs: Any) -> bool:
    """Return whether two published maps are equal, but for the error of the genuine inflation.

    The genuine one finds the nearest obstacle with a wave over four neighbours, which misses it for a few
    cells: their cost is a little too low there.
    """
    higher = ours.astype(int) - theirs
    is_wave_error = (higher >= 0) & (higher <= 3) & (theirs >= 1) & (ours <= 98)
    return bool(np.all((higher == 0) | is_wave_error)) and np.count_nonzero(higher) <= higher.size / 200


class BothCostmaps:
    """Two costmaps with the same parameters and inputs; the outputs are in namespaces."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.processes: list[Process] = []
        self.received = {side: Received() for side in SIDES}
        self._publishers: dict[str, Any] = {}
        for side, received in self.received.items():
            for topic, type_name, take in (
                ("costmap", "nav_msgs/OccupancyGrid", received.on_map),
                ("costmap_updates", "map_msgs/OccupancyGridUpdate", received.on_update),
                ("footprint", "geometry_msgs/PolygonStamped", received.on_footprint),
            ):
                message_class: Any = load_message_class(type_name)
                node.subscribe(f"/{side}/costmap_node/costmap/{topic}", message_class, take)

    def publish(self, topic: str, message: Any, *, subscribers: int = 2) -> None:
        """Publish a message when both nodes have subscribed to the topic."""
        if topic not in self._publishers:
            latch = topic in ("/tf_static", "/map")
            self._publishers[topic] = self.node.advertise(topic, type(message), queue_size=100, latch=latch)
        publisher = self._publishers[topic]
        if not publisher.publication.is_latching:
            wait_until(lambda: publisher.connection_count >= subscribers, 60, f"the costmaps on {topic}")
        publisher.publish(message)

    def place_robot(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Put `base_link` at a pose in `map`, by a static transform, and wait until both nodes are there."""
        transform: Any = load_message_class("geometry_msgs/TransformStamped")(child_frame_id="base_link")
        transform.header.frame_id = "map"
        transform.transform.translation.x, transform.transform.translation.y = x, y
        transform.transform.rotation.z, transform.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self.publish("/tf_static", tf_class([transform]))

    def wait_for_footprints(self, accept: Callable[[list[tuple[float, float]]], bool]) -> None:
        wait_until(
            lambda: all(each.footprint and accept(each.footprint) for each in self.received.values()),
            60,
            lambda: f"the footprints: {[process.output for process in self.processes]}",
        )

    def wait_until_equal(self, change: Callable[[], object] | None = None) -> Any:
        """Wait until both maps have changed and are equal. Return the cells.

        Raises:
            AssertionError: they are not equal after some time; the text shows the difference.
        """
        before = {side: each.cells for side, each in self.received.items()}
        if change is not None:
            change()

        def are_equal() -> bool:
            ours, theirs = (self.received[side] for side in SIDES)
            if change is not None and any(
                np.array_equal(each.cells, before[side]) for side, each in self.received.items()
            ):
                return False
            return (
                ours.info is not None
                and theirs.info is not None
                and ours.place == theirs.place
                and agree(ours.cells, theirs.cells)
            )

        wait_until(are_equal, 20, self._difference)
        return self.received["pipros"].cells

    def _difference(self) -> str:
        ours, theirs = (self.received[side] for side in SIDES)
        if ours.info is None or theirs.info is None or ours.place != theirs.place:
            return (
                f"equal maps: {[each.info for each in (ours, theirs)]} {[p.output for p in self.processes]}"
            )
        rows, columns = np.nonzero(ours.cells != theirs.cells)
        shown = [
            (int(x), int(y), int(ours.cells[y, x]), int(theirs.cells[y, x]))
            for y, x in list(zip(rows, columns, strict=True))[:20]
        ]
        return f"equal maps: {len(rows)} of {ours.cells.size} cells differ (x, y, pipros, genuine): {shown}"


@contextmanager
def both_costmaps(
    ros: RosSystem, parameters: Mapping[str, Any], pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Iterator[BothCostmaps]:
    """Run both costmap nodes with these parameters of the costmap. `map` and `scan` are in the root."""
    ros.serve_master()
    folder = add_to(ros.genuine)
    node = Node("test", environment=Environment(master_uri=ros.master_uri))
    with node:
        for side in SIDES:
            given = {"update_frequency": 20.0, "publish_frequency": 20.0, **parameters}
            node.params.set(f"/{side}/costmap_node/costmap", given)
        both = BothCostmaps(node)
        both.place_robot(*pose)
        commands: dict[str, list[str | Path]] = {
            "pipros": ["rosrun", "costmap_2d", "costmap_2d_node"],
            "genuine": [folder / "lib/costmap_2d/costmap_2d_node"],
        }
        both.processes = [
            getattr(ros, side).start(
                *commands[side], f"__ns:=/{side}", "map:=/map", "scan:=/scan", "points:=/points"
            )
            for side in SIDES
        ]
        yield both
        for process in both.processes:
            process.press_ctrl_c()
        for process in both.processes:
            process.wait()


def grid_message(cells: Any, resolution: float, origin: tuple[float, float]) -> Any:
    """Return an occupancy grid in the frame `map`."""
    message: Any = load_message_class("nav_msgs/OccupancyGrid")()
    message.header.frame_id = "map"
    message.info.height, message.info.width = cells.shape
    message.info.resolution = resolution
    message.info.origin.position.x, message.info.origin.position.y = origin
    message.info.origin.orientation.w = 1.0
    message.data = cells.astype(np.int8).ravel().tolist()
    return message


def scan_message(ranges: Any, stamp_s: float, frame: str = "base_link") -> Any:
    """Return a scan all around."""
    message: Any = load_message_class("sensor_msgs/LaserScan")()
    message.header.frame_id = frame
    message.header.stamp = Time(*divmod(round(stamp_s * 1e9), 1_000_000_000))
    message.angle_min, message.angle_increment = -math.pi, 2 * math.pi / len(ranges)
    message.angle_max = math.pi
    message.range_min, message.range_max = 0.1, 10.0
    message.ranges = [float(each) for each in ranges]
    return message
