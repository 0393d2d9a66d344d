"""Run costmaps of pipros on recorded maps, sensors and poses, and compare their cells with genuine ones."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_libraries.nodes.wiring import stamped
from pipros_robot.navigation import plane
from tests.support.both_navigation import SIDES, BothNodes, both_nodes
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


class Received:
    """The map of one side, made of its messages.

    Attributes:
        footprint: the corners in the newest message.
        place: size, resolution and origin.
        maps, updates: number of maps, and of parts of them, that arrived.
    """

    def __init__(self) -> None:
        self.cells: Any = np.zeros((0, 0), np.int8)
        self.place: tuple[float, ...] = ()
        self.footprint: Any = []
        self.maps = self.updates = 0

    def on_map(self, message: Any) -> None:
        self.maps += 1
        info, position = message.info, message.info.origin.position
        self.cells = np.array(message.data, np.int8).reshape(info.height, info.width)
        self.place = (info.width, info.height, info.resolution, position.x, position.y)

    def on_update(self, message: Any) -> None:
        cells = self.cells.copy()
        part = cells[message.y : message.y + message.height, message.x : message.x + message.width]
        part[...] = np.array(message.data, np.int8).reshape(part.shape)
        self.cells = cells
        self.updates += 1

    def on_footprint(self, message: Any) -> None:
        self.footprint = [(point.x, point.y) for point in message.polygon.points]

    def take(self, step: Any) -> None:
        """Become what was recorded."""
        self.cells, self.footprint, self.updates = step["cells"], step["footprint"], step["updates"]
        self.place = tuple(step["place"])


def agree(ours: Any, theirs: Any) -> bool:
    """Return whether two published maps are equal, but for the error of the genuine inflation.

    The genuine one finds the nearest obstacle with a wave over four neighbours, which misses it for a few
    cells: their cost is a little too low there.
    """
    if ours.shape != theirs.shape:
        return False
    higher = ours.astype(int) - theirs
    is_wave_error = (higher >= 0) & (higher <= 1 + 0.1 * ours) & (theirs >= 1) & (ours <= 98)
    return bool(np.all((higher == 0) | is_wave_error)) and np.count_nonzero(higher) <= higher.size / 200


class BothCostmaps:
    """A node of pipros with a costmap, and what the genuine one published."""

    def __init__(self, both: BothNodes, *, is_rolling: bool) -> None:
        self.both, self._is_rolling = both, is_rolling
        self.received = {side: Received() for side in SIDES}
        own = self.received["pipros"]
        for topic, type_name, take in (
            ("costmap", "nav_msgs/OccupancyGrid", own.on_map),
            ("costmap_updates", "map_msgs/OccupancyGridUpdate", own.on_update),
            ("footprint", "geometry_msgs/PolygonStamped", own.on_footprint),
        ):
            both.node.subscribe(f"/pipros/{both.name}/costmap/{topic}", load_message_class(type_name), take)

    def _next_step(self) -> None:
        self.received["genuine"].take(self.both.recording.step("costmap"))

    def place(self, *frames: tuple[str, str, float, float, float, float]) -> None:
        """Publish static transforms: parent, child, x, y, z and yaw of each."""
        transforms = []
        for parent, child, x, y, z, yaw in frames:
            turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
            transforms += plane.transforms(parent, child, (x, y, z, *turn), Time()).transforms
        tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self.both.publish("tf_static", tf_class(transforms))

    def observe(self, topic: str) -> None:
        """Publish the recorded scan or cloud of a topic, as of now."""
        message = self.both.recording.take(f"publish {topic}")
        message.header.stamp = Time(*divmod(time.time_ns(), 1_000_000_000))
        self.both.publish(topic, message, is_input=False)

    def move_to(self, x: float, y: float, yaw: float) -> None:
        """Put `base_link` at a pose in `map`, and wait until pipros publishes the recorded footprint.

        A rolling window must have moved, too: a map that arrives later would look like the effect of the next
        message, which would then be transformed with the pose after that.
        """
        own, genuine = (self.received[side] for side in SIDES)
        before, place = own.footprint, own.place
        self.place(("map", "base_link", x, y, 0.0, yaw))
        self._next_step()

        def has_moved() -> bool:
            is_new = own.footprint != before and (not self._is_rolling or own.place != place)
            shapes = np.shape(own.footprint), np.shape(genuine.footprint)
            return (
                is_new and shapes[0] == shapes[1] and np.allclose(own.footprint, genuine.footprint, atol=1e-5)
            )

        wait_until(
            has_moved, 60, lambda: f"footprint {genuine.footprint}: {own.footprint} {self.both.output}"
        )

    def wait_until_equal(self, change: Callable[[], object] | None = None) -> Any:
        """Wait until both maps are equal and, if `change` is given, ours was changed by it. Return the cells.

        Raises:
            AssertionError: they are not equal after some time; the text shows the difference.
        """
        if change is not None:
            self._settle()
        own, genuine = (self.received[side] for side in SIDES)
        before = own.cells
        if change is not None:
            change()
        self._next_step()
        wait_until(
            lambda: (
                (change is None or not np.array_equal(own.cells, before))
                and own.place == genuine.place
                and agree(own.cells, genuine.cells)
            ),
            30,
            self._difference,
        )
        return own.cells

    def _settle(self) -> None:
        """Wait until pipros has published twice or stays silent: later messages show later changes."""
        own = self.received["pipros"]
        count, end_s = own.maps + own.updates, time.monotonic() + 0.5
        wait_until(lambda: time.monotonic() > end_s or own.maps + own.updates > count + 1)

    def _difference(self) -> str:
        ours, theirs = (self.received[side] for side in SIDES)
        if ours.place != theirs.place or ours.place == ():
            return f"equal maps: {ours.place} and {theirs.place} {self.both.output}"
        rows, columns = np.nonzero(ours.cells != theirs.cells)
        shown = [
            (int(x), int(y), int(ours.cells[y, x]), int(theirs.cells[y, x]))
            for y, x in list(zip(rows, columns, strict=True))[:20]
        ]
        return f"equal maps: {len(rows)} of {ours.cells.size} cells differ (x, y, pipros, genuine): {shown}"


@contextmanager
def both_costmaps(
    ros: RosSystem,
    recording: Recording,
    parameters: Mapping[str, Any],
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    program: tuple[str, str, str] = ("costmap_2d", "costmap_2d_node", "costmap_node"),
    topics: Sequence[str] = ("map", "scan"),
    others: Mapping[str, Any] | None = None,
) -> Iterator[BothCostmaps]:
    """Run the node with these parameters of the costmap.

    Args:
        pose: x, y and yaw of `base_link` in `map`.
        program: package, program and name of the node.
        topics: inputs, which the node reads in the root namespace.
        others: parameters of the node beside the costmap's.
    """
    given = {"update_frequency": 20.0, "publish_frequency": 20.0, **parameters}
    package, executable, name = program
    remaps = [f"{topic}:=/{topic}" for topic in topics]
    with both_nodes(
        ros, recording, package, executable, {"costmap": given, **(others or {})}, name=name, remaps=remaps
    ) as both:
        costmaps = BothCostmaps(both, is_rolling=bool(given.get("rolling_window")))
        costmaps.place(("map", "base_link", pose[0], pose[1], 0.0, pose[2]))
        yield costmaps


def grid_message(cells: Any, resolution: float, origin: tuple[float, float]) -> Any:
    """Return an occupancy grid in the frame `map`."""
    message = stamped("nav_msgs/OccupancyGrid", "map", Time())
    message.info.height, message.info.width = cells.shape
    message.info.resolution = resolution
    message.info.origin.position.x, message.info.origin.position.y = origin
    message.info.origin.orientation.w = 1.0
    message.data = cells.astype(np.int8).ravel().tolist()
    return message


def scan_message(ranges: Any, stamp_s: float) -> Any:
    """Return a scan all around."""
    return stamped(
        "sensor_msgs/LaserScan", "base_link", Time.from_sec(stamp_s), angle_min=-math.pi, angle_max=math.pi,
        angle_increment=2 * math.pi / len(ranges), range_min=0.1, range_max=10.0,
        ranges=list(map(float, ranges)),
    )  # fmt: skip


def cloud_message(points: Any, stamp_s: float, frame: str) -> Any:
    """Return points as a PointCloud2 whose fields are z, a padding, x and y."""
    rows = np.zeros(len(points), np.dtype([("z", "<f4"), ("other", "<u2"), ("x", "<f4"), ("y", "<f4")]))
    rows["x"], rows["y"], rows["z"] = np.asarray(points, np.float32).T
    field: Any = load_message_class("sensor_msgs/PointField")
    return stamped(
        "sensor_msgs/PointCloud2", frame, Time.from_sec(stamp_s), height=1, width=len(points), point_step=14,
        row_step=14 * len(points), data=rows.tobytes(), fields=[
            field("z", 0, 7, 1), field("other", 4, 4, 1), field("x", 6, 7, 1), field("y", 10, 7, 1),
        ],
    )  # fmt: skip
