"""The node and program slam_gmapping: connects `GridSlam` to topics, a service and transforms."""

from __future__ import annotations

import logging
import math
import threading
import time
from typing import Any, Final

import numpy as np

from pipros.basics.intervals import elapsed
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.service_server import CallFailed
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns
from pipros_libraries.transforms.pose import IDENTITY, Pose, composed, from_roll_pitch_yaw, inverted, rotate
from pipros_robot.navigation import plane
from pipros_robot.navigation.mapping.hit_maps import Array
from pipros_robot.navigation.mapping.settings import read_settings
from pipros_robot.navigation.mapping.slam import GridSlam
from pipros_robot.navigation.mapping.survey import Survey
from pipros_robot.navigation.plane import MAPPED_CELLS

TRANSFORM_S: Final = 2.0
"""Longest wait for the transform of a scan, on the node's clock."""
USUAL_SPEED: Final = 0.4
"""Assumed speed of the robot in m/s, used to judge whether the node is fast enough for real time."""
_FLAT: Final = 0.001


class GmappingNode:
    """Builds a map from the scans of a laser. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register topics and the service, and start publishing the transform.

        Raises:
            InvalidParameter: a parameter has an invalid value.
        """
        self._node, self._log, self._quiet = node, log, Throttle(log, 5.0)
        self._settings = settings = read_settings(read_parameters(node))
        self._rng = np.random.default_rng(settings.seed if settings.seed >= 0 else None)
        self._lock = threading.Lock()
        self._frames = Frames(node, log)
        self._slam: GridSlam | None = None
        self._laser: tuple[Pose, bool, int] | None = None
        self._correction = IDENTITY
        self._scans = self._mapped_ns = self._stamped_ns = 0
        self._has_measured = False
        self._map: Any = None
        self._entropy = advertise(node, "~entropy", "std_msgs/Float64", latch=True)
        self._maps = advertise(node, "map", "nav_msgs/OccupancyGrid", latch=True)
        self._metadata = advertise(node, "map_metadata", "nav_msgs/MapMetaData", latch=True)
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100)
        serve(node, "dynamic_map", "nav_msgs/GetMap", lambda _: self._last_map())
        subscribe(node, "scan", "sensor_msgs/LaserScan", self._on_scan, 5)
        if settings.transform_publish_period > 0.0:
            schedule.every(settings.transform_publish_period, self._publish_transform)

    def _last_map(self) -> Any:
        if self._map is None:
            raise CallFailed("there is no map yet")
        return self._map

    def _publish_transform(self) -> None:
        settings = self._settings
        stamp_ns = self._node.clock.now_ns() + round(settings.tf_delay * NS_PER_S)
        if stamp_ns == self._stamped_ns:  # simulated time stands still; tf warns about repeated timestamps
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
        self._laser = self._laser or self._find_laser(message)
        if self._laser is None:
            return
        mounting, is_reversed, beams = self._laser
        if len(message.ranges) != beams:
            text = "a scan is ignored: it has %d ranges, but the first one had %d"
            self._quiet.warning(text, len(message.ranges), beams)
            return
        stamp_ns, frame = in_ns(message.header.stamp), message.header.frame_id.removeprefix("/")
        found = self._frames.awaited(settings.odom_frame, frame, stamp_ns, TRANSFORM_S)
        if found is None:
            return
        odometry = plane.flat(composed(found, mounting))
        ranges = np.array(message.ranges[::-1] if is_reversed else message.ranges, float)
        ranges[ranges < message.range_min] = message.range_max
        slam = self._slam or self._start(message, odometry, beams)
        if not slam.scan(odometry, ranges, stamp_ns / NS_PER_S):
            return
        x, y, yaw = slam.poses[slam.best].tolist()
        self._slam = slam
        with self._lock:
            self._correction = composed(plane.raised((x, y, yaw)), inverted(plane.raised(odometry)))
        age_s = elapsed(stamp_ns, self._mapped_ns) / NS_PER_S
        if self._map is None or age_s > settings.map_update_interval:
            self._mapped_ns = stamp_ns
            self._publish_map(slam)
        if not self._has_measured:
            self._judge_speed(slam, ranges, message)

    def _find_laser(self, message: Any) -> tuple[Pose, bool, int] | None:
        """Return the pose, in the laser's frame, of an equivalent upright laser with angles centred on 0.

        Also return whether the ranges must be reversed for that laser, and their number. If the laser is not
        horizontal, the scan is invalid, or the transform is not available, warn and return None.
        """
        frame, stamp_ns = message.header.frame_id.removeprefix("/"), in_ns(message.header.stamp)
        base = self._frames.awaited(self._settings.base_frame, frame, stamp_ns, TRANSFORM_S)
        if base is None:
            return None
        up = rotate(inverted(base), (0.0, 0.0, 1.0))[2]
        if abs(abs(up) - 1.0) > _FLAT:
            self._log.warning("the laser must be horizontal; the z component of its z axis is %.3f", up)
            return None
        least, most = max(message.range_min, 0.01), message.range_max
        is_usual = 0 < len(message.ranges) <= plane.MOST_BEAMS and most > least
        if not (is_usual and math.isfinite(message.angle_min + message.angle_max + message.angle_increment)):
            text = "a scan needs finite angles, 1 to %d ranges, got %d, and range_max > %g, got %g"
            self._quiet.warning(text, plane.MOST_BEAMS, len(message.ranges), least, most)
            return None
        centre = (message.angle_min + message.angle_max) / 2.0
        is_reversed = (message.angle_min > message.angle_max) == (up > 0.0)
        roll, yaw = (0.0, centre) if up > 0.0 else (math.pi, -centre)
        return (0.0, 0.0, 0.0, *from_roll_pitch_yaw(roll, 0.0, yaw)), is_reversed, len(message.ranges)

    def _start(self, message: Any, odometry: plane.Triple, beams: int) -> GridSlam:
        span, step = abs(message.angle_max - message.angle_min), abs(message.angle_increment)
        angles = -span / 2.0 + step * np.arange(beams)
        settings = self._settings = self._settings.with_ranges(message.range_max)
        self._survey = Survey(settings, angles, MAPPED_CELLS)
        return GridSlam(settings, angles, odometry, self._rng)

    def _judge_speed(self, slam: GridSlam, ranges: Array, message: Any) -> None:
        """Warn if matching a scan takes longer than the interval between two processed scans."""
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
                "too slow: matching a scan to %d particles takes %.2f s, but at %.1f m/s a scan is due "
                "every %.2f s. Try fewer ~particles, a larger ~lskip, or a longer ~linearUpdate",
                settings.particles, taken_s, USUAL_SPEED, interval_s,
            )  # fmt: skip

    def _publish_map(self, slam: GridSlam) -> None:
        """Publish the map of the best particle, and the entropy of the particles."""
        entropy = slam.entropy()
        if entropy > 0.0:
            self._entropy.publish(load_message_class("std_msgs/Float64")(entropy))
        self._survey.follow(slam.steps[slam.best])
        values = self._survey.values()
        message = stamped("nav_msgs/OccupancyGrid", self._settings.map_frame, stamp(self._node.clock))
        message.info.map_load_time, message.info.resolution = message.header.stamp, self._settings.delta
        message.info.height, message.info.width = values.shape
        message.info.origin.position.x, message.info.origin.position.y = self._survey.origin
        message.info.origin.orientation.w = 1.0
        message.data = values.ravel()
        self._map = message
        self._maps.publish(message)
        self._metadata.publish(message.info)


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("slam_gmapping", "gmapping", GmappingNode)
