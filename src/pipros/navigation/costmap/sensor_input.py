"""The messages of one observation source, until their transforms are known."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from functools import partial
from threading import RLock
from typing import Any, Final, NamedTuple

from pipros.libraries.transforms.errors import TransformException
from pipros.libraries.transforms.messages import in_ns
from pipros.msg import load_message_class
from pipros.navigation.costmap.observations import (
    Points3D,
    Source,
    cloud_points,
    old_cloud_points,
    scan_points,
)
from pipros.navigation.frames import Frames
from pipros.navigation.limits import NavigationLimits
from pipros.node import Node

_WAITING: Final = 50
_SCAN_TOLERANCE_NS: Final = 50_000_000

DATA_TYPES: Final[dict[str, tuple[str, Callable[[Any], Points3D]]]] = {
    "PointCloud": ("sensor_msgs/PointCloud", old_cloud_points),
    "PointCloud2": ("sensor_msgs/PointCloud2", cloud_points),
    "LaserScan": ("sensor_msgs/LaserScan", scan_points),
}


class _Arrived(NamedTuple):
    stamp_ns: int
    frame: str
    points: Points3D


class SensorInput:
    """Subscribes to a sensor's topic, and adds its points to a source.

    At most 50 messages wait for their transforms; `NavigationLimits.costmap_points` limits their points.
    """

    def __init__(
        self, node: Node, log: logging.Logger, frames: Frames, frame: str, source: Source, lock: RLock
    ) -> None:
        """`frame` is the frame of the costmap, and `lock` its lock."""
        self._node, self._log, self._frames, self._frame = node, log, frames, frame
        self._source, self._lock = source, lock
        self._limit = node.limits.of(NavigationLimits).costmap_points
        self._waiting: deque[_Arrived] = deque(maxlen=_WAITING)
        self.is_active = True
        settings = source.settings
        type_name, read = DATA_TYPES[settings.data_type]
        if settings.data_type == "LaserScan":
            read = partial(scan_points, is_infinity_valid=settings.is_infinity_valid)
        source.touch(node.clock.now_ns())
        message_class: Any = load_message_class(type_name)
        node.subscribe(settings.topic, message_class, partial(self._on_message, read), queue_size=50)

    def _on_message(self, read: Callable[[Any], Points3D], message: Any) -> None:
        if not self.is_active:
            return
        try:
            points = read(message)
        except ValueError as error:
            self._log.error("%s: %s", self._source.settings.topic, error)
            return
        if len(points) > self._limit:
            self._log.warning(
                "%s: only %d of %d points are used (PIPROS_LIMITS, costmap_points)",
                self._source.settings.topic, self._limit, len(points),
            )  # fmt: skip
            points = points[: self._limit]
        arrived = _Arrived(in_ns(message.header.stamp), message.header.frame_id.lstrip("/"), points)
        with self._lock:
            self._waiting.append(arrived)
            while sum(len(each.points) for each in self._waiting) > self._limit:
                self._waiting.popleft()
        self.process()

    def process(self) -> None:
        """Add the points whose transforms are known by now."""
        with self._lock:
            for each in [each for each in self._waiting if self._add(each)]:
                self._waiting.remove(each)

    def _add(self, arrived: _Arrived) -> bool:
        """Add the points of a message. Return False if its transforms are not known yet."""
        settings, buffer = self._source.settings, self._frames.buffer
        sensor = settings.sensor_frame or arrived.frame
        later_ns = arrived.stamp_ns and arrived.stamp_ns + _SCAN_TOLERANCE_NS
        try:
            if settings.data_type == "LaserScan" and buffer.can_transform(
                self._frame, arrived.frame, later_ns
            ):
                return False
            cloud = buffer.lookup(self._frame, arrived.frame, arrived.stamp_ns)[1]
            origin = buffer.lookup(self._frame, sensor, arrived.stamp_ns)[1]
        except TransformException:
            return False
        now_ns = self._node.clock.now_ns()
        self._source.add(arrived.points, cloud, origin, arrived.stamp_ns, now_ns, self._limit)
        return True
