"""Hold back the messages of an observation source until their transforms are available."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, Final, NamedTuple

from pipros_libraries.nodes.wiring import subscribe
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.navigation.costmap.core import CostmapCore
from pipros_robot.navigation.costmap.observations import (
    ObservationSource,
    Points3D,
    cloud_points,
    old_cloud_points,
    scan_points,
)

COSTMAP_POINTS = 2_000_000
"""Maximum number of points that a costmap stores for each observation source. The same number of points may
wait for their transforms. Beyond it, the remaining points of a cloud, the oldest waiting messages or the
oldest observations are dropped.
"""

_WAITING: Final = 50
_SCAN_TOLERANCE_NS: Final = 50_000_000

DATA_TYPES: Final[dict[str, Callable[[Any], Points3D]]] = {
    "PointCloud": old_cloud_points, "PointCloud2": cloud_points, "LaserScan": scan_points,
}  # fmt: skip


class _Arrived(NamedTuple):
    stamp_ns: int
    frame: str
    points: Points3D


class SensorInput:
    """Subscribes to a sensor's topic, and adds its points to a source.

    At most 50 messages wait for their transforms. `COSTMAP_POINTS` limits the total number
    of their points.

    Attributes:
        is_active: whether messages are used.
        has_data: whether a message has arrived.
        topic: the name of the topic.
    """

    def __init__(self, costmap: CostmapCore, source: ObservationSource) -> None:
        self._costmap, self._source = costmap, source
        self._limit = COSTMAP_POINTS
        self._waiting: deque[_Arrived] = deque(maxlen=_WAITING)
        self.is_active, self.has_data = True, False
        settings = source.settings
        self._read = DATA_TYPES[settings.data_type]
        if settings.data_type == "LaserScan":
            self._read = partial(scan_points, is_infinity_valid=settings.inf_is_valid)
        self.topic = costmap.node.resolve(settings.topic)
        source.touch(costmap.node.clock.now_ns())
        subscribe(costmap.node, settings.topic, f"sensor_msgs/{settings.data_type}", self._on_message, 50)

    def _on_message(self, message: Any) -> None:
        if not self.is_active:
            return
        topic, log = self._source.settings.topic, self._costmap.log
        try:
            points = self._read(message)
        except ValueError as error:
            log.error("%s: %s", topic, error)
            return
        if len(points) > self._limit:
            text = "%s: only %d of %d points are used"
            log.warning(text, topic, self._limit, len(points))
            points = points[: self._limit]
        self.has_data = True
        arrived = _Arrived(in_ns(message.header.stamp), message.header.frame_id.lstrip("/"), points)
        with self._costmap.lock:
            self._waiting.append(arrived)
            while sum(len(each.points) for each in self._waiting) > self._limit:
                self._waiting.popleft()
        self.process()

    def process(self) -> None:
        """Add the points of waiting messages whose transforms are now available."""
        with self._costmap.lock:
            for _ in range(len(self._waiting)):
                each = self._waiting.popleft()  # for good, if it raises an error
                if not self._add(each):
                    self._waiting.append(each)

    def _add(self, arrived: _Arrived) -> bool:
        """Add the points of a message. Return False if its transforms are not available yet."""
        settings, buffer, frame = (
            self._source.settings,
            self._costmap.frames.buffer,
            self._costmap.global_frame,
        )
        sensor = settings.sensor_frame or arrived.frame
        later_ns = arrived.stamp_ns and arrived.stamp_ns + _SCAN_TOLERANCE_NS
        try:
            if settings.data_type == "LaserScan" and buffer.can_transform(frame, arrived.frame, later_ns):
                return False
            cloud = buffer.lookup(frame, arrived.frame, arrived.stamp_ns)[1]
            origin = buffer.lookup(frame, sensor, arrived.stamp_ns)[1]
        except TransformException:
            return False
        now_ns = self._costmap.node.clock.now_ns()
        self._source.add(arrived.points, cloud, origin, arrived.stamp_ns, now_ns, self._limit)
        return True
