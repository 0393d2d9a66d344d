"""The node slam_gmapping: topics, the service and transforms around `GridSlam`; and its program."""

from __future__ import annotations

import logging
import math
import threading
import time
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.libraries.transforms.messages import in_ns
from pipros.libraries.transforms.pose import (
    Pose,
    composed,
    from_roll_pitch_yaw,
    inverted,
    rotate,
)
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import NS_PER_S
from pipros.navigation import plane
from pipros.navigation.frames import Frames
from pipros.navigation.limits import NavigationLimits
from pipros.navigation.mapping.settings import Settings, read_settings
from pipros.navigation.mapping.slam import GridSlam
from pipros.navigation.mapping.survey import Survey
from pipros.navigation.parameters import InvalidParameter, read_parameters
from pipros.navigation.schedule import Schedule
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.node.service_server import CallFailed

TRANSFORM_S: Final = 2.0
"""Longest wait for the transform of a scan, in the node's time."""
USUAL_SPEED: Final = 0.4
"""Speed of a robot in m/s, with which the node judges whether it will work in real time."""
_FLAT: Final = 0.001


class GmappingNode:
    """Builds a map from the scans of a laser. Callbacks run in several threads, under one lock."""

    def __init__(self, node: Node, log: logging.Logger, settings: Settings) -> None:
        """Register topics and the service, and start to publish the transform."""
        self._node, self._log, self._settings = node, log, settings
        self._rng = np.random.default_rng(settings.seed if settings.seed >= 0 else None)
        self._lock = threading.Lock()
        self._frames = Frames(node, log)
        self._slam: GridSlam | None = None
        self._laser: tuple[Pose, bool, int] | None = None
        self._correction: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        self._scans = 0
        self._mapped_ns = self._stamped_ns = 0
        self._has_measured = False
        self._map: Any = None
        self._map_class: Any = load_message_class("nav_msgs/OccupancyGrid")
        self._entropy_class: Any = load_message_class("std_msgs/Float64")
        metadata: Any = load_message_class("nav_msgs/MapMetaData")
        scan: Any = load_message_class("sensor_msgs/LaserScan")
        service = load_service_class("nav_msgs/GetMap")
        self._entropy = node.advertise("~entropy", self._entropy_class, queue_size=1, latch=True)
        self._maps = node.advertise("map", self._map_class, queue_size=1, latch=True)
        self._metadata = node.advertise("map_metadata", metadata, queue_size=1, latch=True)
        self._tf = node.advertise("/tf", load_message_class("tf2_msgs/TFMessage"), queue_size=100)
        node.serve("dynamic_map", service, lambda _: service._response_class(self._last_map()))
        node.subscribe("scan", scan, self._on_scan, queue_size=5)
        schedule = Schedule(node)
        if settings.transform_publish_period > 0.0:
            schedule.every(settings.transform_publish_period, self._publish_transform)
        schedule.start()

    def _last_map(self) -> Any:
        if self._map is None:
            raise CallFailed("there is no map yet")
        return self._map

    def _publish_transform(self) -> None:
        settings = self._settings
        stamp_ns = self._node.clock.now_ns() + round(settings.tf_delay * NS_PER_S)
        if stamp_ns == self._stamped_ns:  # simulated time stands still: tf reports repeated timestamps
            return
        self._stamped_ns = stamp_ns
        with self._lock:
            correction = self._correction
        self._tf.publish(plane.transforms(settings.map_frame, settings.odom_frame, correction, stamp_ns))

    # -- scans -----------------------------------------------------------------------

    def _on_scan(self, message: Any) -> None:
        settings = self._settings
        self._scans += 1
        if self._scans % settings.throttle_scans:
            return
        if self._laser is None:
            self._laser = self._find_laser(message)
            if self._laser is None:
                return
        mounting, is_reversed, beams = self._laser
        if len(message.ranges) != beams:
            return
        stamp_ns, frame = in_ns(message.header.stamp), message.header.frame_id.removeprefix("/")
        found = self._frames.awaited(settings.odom_frame, frame, stamp_ns, TRANSFORM_S)
        if found is None:
            return
        odometry = plane.flat(composed(found, mounting))
        ranges = np.array(message.ranges[::-1] if is_reversed else message.ranges, float)
        ranges[ranges < message.range_min] = message.range_max
        with self._lock:
            slam = self._slam
        if slam is None:
            slam = self._start(message, odometry, beams)
        if not slam.scan(odometry, ranges, stamp_ns / NS_PER_S):
            return
        x, y, yaw = slam.poses[slam.best].tolist()
        in_map, in_odom = plane.raised((x, y, yaw)), plane.raised(odometry)
        with self._lock:
            self._slam = slam
            self._correction = composed(in_map, inverted(in_odom))
        if self._map is None or stamp_ns - self._mapped_ns > settings.map_update_interval * NS_PER_S:
            self._mapped_ns = stamp_ns
            self._publish_map(slam)
        if not self._has_measured:
            self._judge_speed(slam, ranges, message)

    def _find_laser(self, message: Any) -> tuple[Pose, bool, int] | None:
        """Return the pose of the centred, upright laser in its frame, and how to read its ranges.

        That is, whether they are reversed, and their number. Return None with a warning if the laser is not
        horizontal, or the transform is not known.
        """
        frame = message.header.frame_id.removeprefix("/")
        base = self._frames.awaited(
            self._settings.base_frame, frame, in_ns(message.header.stamp), TRANSFORM_S
        )
        if base is None:
            return None
        up = rotate(inverted(base), (0.0, 0.0, 1.0))[2]
        if abs(abs(up) - 1.0) > _FLAT:
            self._log.warning("the laser must be horizontal; the z axis of its frame is at %.3f", up)
            return None
        if not (message.ranges and math.isfinite(message.angle_min + message.angle_max)):
            self._log.warning("a scan must have ranges and finite angles: it is ignored")
            return None
        centre = (message.angle_min + message.angle_max) / 2.0
        is_reversed = (message.angle_min > message.angle_max) == (up > 0.0)
        roll, yaw = (0.0, centre) if up > 0.0 else (math.pi, -centre)
        turn = from_roll_pitch_yaw(roll, 0.0, yaw)
        return (0.0, 0.0, 0.0, *turn), is_reversed, len(message.ranges)

    def _start(self, message: Any, odometry: tuple[float, float, float], beams: int) -> GridSlam:
        span, step = abs(message.angle_max - message.angle_min), abs(message.angle_increment)
        angles = -span / 2.0 + step * np.arange(beams)
        settings = self._settings = self._settings.with_ranges(message.range_max)
        self._survey = Survey(settings, angles, self._node.limits.of(NavigationLimits).mapped_cells)
        return GridSlam(settings, angles, odometry, self._rng)

    def _judge_speed(self, slam: GridSlam, ranges: NDArray[np.float64], message: Any) -> None:
        """Warn if matching a scan takes longer than the time between two processed scans."""
        self._has_measured = True
        settings, before = self._settings, time.process_time()
        slam.try_match(ranges)
        taken_s = time.process_time() - before
        interval_s = settings.linearUpdate / USUAL_SPEED
        if settings.temporalUpdate >= 0.0:
            interval_s = min(interval_s, settings.temporalUpdate)
        interval_s = max(interval_s, message.scan_time * settings.throttle_scans)
        if taken_s > interval_s:
            self._log.warning(
                "not in real time: matching a scan to %d particles takes %.2f s, but at %.1f m/s one is due "
                "every %.2f s. Try fewer ~particles, a larger ~lskip, or a longer ~linearUpdate",
                settings.particles, taken_s, USUAL_SPEED, interval_s,
            )  # fmt: skip

    def _publish_map(self, slam: GridSlam) -> None:
        """Publish the map of the best particle, and the entropy of the poses."""
        entropy = slam.entropy()
        if entropy > 0.0:
            self._entropy.publish(self._entropy_class(entropy))
        self._survey.follow(slam.steps[slam.best])
        values = self._survey.values()
        message = self._map_class()
        message.header.frame_id = self._settings.map_frame
        message.header.stamp = message.info.map_load_time = plane.time_of(self._node.clock.now_ns())
        message.info.resolution = self._settings.delta
        message.info.height, message.info.width = values.shape
        message.info.origin.position.x, message.info.origin.position.y = self._survey.origin
        message.info.origin.orientation.w = 1.0
        message.data = values.ravel()
        self._map = message
        self._maps.publish(message)
        self._metadata.publish(message.info)


@exits_after_ctrl_c()
def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    with roscpp_program("slam_gmapping", "gmapping") as (node, log):
        try:
            settings = read_settings(read_parameters(node))
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        GmappingNode(node, log, settings)
        node.wait_for_shutdown()
    return 0
