"""The node and program amcl: connects a `Localizer` to topics, services, transforms and parameters."""

from __future__ import annotations

import logging
import math
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from pipros.basics.errors import Interrupted, Unreachable
from pipros.basics.intervals import elapsed
from pipros.msg import load_service_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import serve, subscribe
from pipros_libraries.reconfiguring.declared import settings_of
from pipros_libraries.reconfiguring.server import Reconfigurable
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import IDENTITY, Pose, composed, from_roll_pitch_yaw, roll_pitch_yaw
from pipros_robot.navigation.amcl.grid import GridMap
from pipros_robot.navigation.amcl.localizer import Localizer
from pipros_robot.navigation.amcl.publications import Publications
from pipros_robot.navigation.amcl.sensors import Beams, read_beams
from pipros_robot.navigation.amcl.settings import (
    LASER_MODELS,
    ODOMETRY_MODELS,
    AmclSettings,
    Belief,
    checked,
    read_belief,
    read_settings,
)
from pipros_robot.navigation.plane import MOST, flat, is_measured

NO_SCAN_S: Final = 15.0
MAP_REQUEST_S: Final = 0.5
TRANSFORM_S: Final = 2.0
"""Longest wait for the transform of a scan, on the node's clock."""
INITIAL_POSE_S: Final = 0.5
"""Longest wait for the motion since the timestamp of an initial pose."""


class AmclNode:
    """Localises a robot. Callbacks run in several threads and share a lock that is not held while waiting."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register topics and services, get the map, and serve the reconfigurable settings.

        Raises:
            InvalidParameter: a parameter has an invalid value.
            Interrupted: the node was shut down while it waited for the map.
        """
        self._node, self._log = node, log
        self._settings = settings = read_settings(read_parameters(node))
        self._rng = np.random.default_rng(settings.seed if settings.seed >= 0 else None)
        self._lock = threading.RLock()
        self._belief = self._read_belief()
        self._grid: GridMap | None = None
        self._localizer: Localizer | None = None
        self._waiting: Belief | None = None
        self._has_settings = False
        self._saved_ns, self._scan_s = 0, time.monotonic()
        self._lasers: dict[tuple[str, str], Pose] = {}
        self._frames = Frames(node, log)
        self._out = Publications(node, settings)
        serve(node, "global_localization", "std_srvs/Empty", lambda _: self._start_anywhere())
        serve(node, "request_nomotion_update", "std_srvs/Empty", lambda _: self._force_update())
        serve(node, "set_map", "nav_msgs/SetMap", self._set_map)
        pose = "geometry_msgs/PoseWithCovarianceStamped"
        subscribe(node, "initialpose", pose, self._on_initial_pose, 2)
        subscribe(node, "scan", "sensor_msgs/LaserScan", self._on_scan, 100)
        node.on_shutdown(self._save)
        if settings.use_map_topic:
            subscribe(node, "map", "nav_msgs/OccupancyGrid", self._on_map)
        else:
            self._request_map()
        Reconfigurable(node, "~", settings_of(AmclSettings), self._reconfigure)
        schedule.every(NO_SCAN_S, self._check_scans)

    # -- the map and the initial pose ------------------------------------------------

    def _request_map(self) -> None:
        service: Any = load_service_class("nav_msgs/GetMap")
        client = self._node.client("static_map", service)
        self._log.info("requesting the map from the service static_map")
        while not self._node.is_ending:
            try:
                return self._use_map(client.call(service._request_class(), timeout_s=60.0).map)
            except ServiceFailed as error:
                self._log.warning("requesting the map failed: %s. Trying again", error)
            self._node.wait_for_shutdown(MAP_REQUEST_S)
        raise Interrupted("the node was shut down while it waited for the map")

    def _on_map(self, message: Any) -> None:
        if not (self._settings.first_map_only and self._grid is not None):
            self._use_map(message)

    def _use_map(self, message: Any) -> None:
        info, frame = message.info, message.header.frame_id.removeprefix("/")
        if frame != self._settings.global_frame_id:
            self._log.warning("the map is in the frame %s, not %s", frame, self._settings.global_frame_id)
        corner = info.origin.position.x, info.origin.position.y, info.resolution
        if (
            not info.resolution > 0.0
            or not all(map(math.isfinite, corner))
            or len(message.data) != info.width * info.height
            or not message.data
        ):
            self._log.error(
                "a map must have a finite origin, a resolution > 0, and width * height cells: %s, %sx%s, %s",
                corner, info.width, info.height, len(message.data),
            )  # fmt: skip
            return
        values = np.array(message.data, np.int8).reshape(info.height, info.width)
        # Like amcl, use the resolution in the message, which has single precision.
        grid = GridMap(values, info.resolution, (info.origin.position.x, info.origin.position.y))
        with self._lock:
            self._grid, self._belief = grid, self._read_belief()
            self._rebuild(self._belief)
            if self._waiting is not None:
                self._start_at(self._waiting)
        self._log.info("using a map of %s x %s cells of %.3f m", info.width, info.height, info.resolution)

    def _rebuild(self, belief: Belief) -> None:
        if self._grid is not None:
            self._localizer = Localizer(self._grid, self._settings, belief, self._rng)

    def _read_belief(self) -> Belief:
        belief, ignored = read_belief(read_parameters(self._node))
        for name in ignored:
            self._log.warning("~%s is not a finite number: it is ignored", name)
        return belief

    def _on_initial_pose(self, message: Any) -> None:
        frame, wanted = message.header.frame_id.removeprefix("/"), self._settings.global_frame_id
        if not frame:
            self._log.warning("an initial pose has no frame; the frame of the map is assumed")
        elif frame != wanted:
            self._log.warning("initial poses must be in the frame %s, got one in %s", wanted, frame)
            return
        pose, covariance = message.pose.pose, message.pose.covariance
        if not is_measured(pose_of(pose.position, pose.orientation)):
            self._log.warning("an initial pose is ignored: it must be finite, with an orientation")
            return
        moved = self._motion_since(in_ns(message.header.stamp))
        x, y, yaw = flat(composed(pose_of(pose.position, pose.orientation), moved))
        belief = Belief(x, y, yaw, covariance[0], covariance[7], covariance[35], covariance[1])
        if not all(abs(each) <= MOST for each in (belief.xx, belief.yy, belief.aa, belief.xy)):
            self._log.warning(
                "an initial pose is ignored: its covariance must be finite, and at most %g", MOST
            )
            return
        with self._lock:
            self._start_at(belief)
            if self._settings.force_update_after_initialpose:
                self._force_update()
        self._log.info("setting the pose to %.3f %.3f %.3f", x, y, yaw)

    def _motion_since(self, stamp_ns: int) -> Pose:
        """Return the robot's pose relative to its pose at `stamp_ns`; if unknown, the identity."""
        base, odom = self._settings.base_frame_id, self._settings.odom_frame_id
        pose = self._frames.motion(base, odom, stamp_ns, self._node.clock.now_ns(), INITIAL_POSE_S)
        if pose is None and self._out.correction is not None:
            self._log.warning("the motion since the timestamp of an initial pose is unknown")
        return IDENTITY if pose is None else pose

    def _start_at(self, belief: Belief) -> None:
        self._waiting = belief if self._localizer is None else None
        if self._localizer is not None:
            self._localizer.start_at(belief)

    # -- services --------------------------------------------------------------------

    def _start_anywhere(self) -> None:
        with self._lock:
            if self._localizer is not None:
                self._localizer.start_anywhere()
        self._log.info("the particles are spread over the whole map")

    def _force_update(self) -> None:
        with self._lock:
            if self._localizer is not None:
                self._localizer.force_update()

    def _set_map(self, request: Any) -> bool:
        self._use_map(request.map)
        self._on_initial_pose(request.initial_pose)
        if self._settings.force_update_after_set_map:
            self._force_update()
        return True

    def _reconfigure(self, values: Mapping[str, Any], _: int) -> None:
        """Apply changed settings. The first call, at startup, is ignored, as in amcl."""
        if not self._has_settings:
            self._has_settings = True
            return
        for name, models in (("laser_model_type", LASER_MODELS), ("odom_model_type", ODOMETRY_MODELS)):
            if values[name] not in models:
                self._log.warning("~%s must be one of %s, got %s", name, ", ".join(models), values[name])
        with self._lock:
            self._settings = self._out.settings = checked(replace(self._settings, **values))
            self._rebuild(self._out.belief or self._belief)

    # -- scans -----------------------------------------------------------------------

    def _on_scan(self, message: Any) -> None:
        settings = self._settings
        self._scan_s = time.monotonic()
        if self._localizer is None:
            return
        stamp_ns = in_ns(message.header.stamp)
        base = self._frames.awaited(settings.odom_frame_id, settings.base_frame_id, stamp_ns, TRANSFORM_S)
        beams = self._beams(message) if base is not None else None
        if base is None or beams is None:
            return
        with self._lock:
            localizer = self._localizer
            outcome = localizer.scan(message.header.frame_id, flat(base), beams)
            if outcome.is_updated:
                self._out.publish_cloud(localizer.particles.poses, self._node.clock.now_ns())
            if outcome.estimate is not None:
                self._out.publish_estimate(outcome.estimate, stamp_ns, base)
            elif self._out.correction is not None:
                self._out.publish_transform(stamp_ns)
                self._save_if_due()
            self._out.publish_diagnostics()

    def _beams(self, message: Any) -> Beams | None:
        """Return the beams of a scan in the robot's frame. If the scan cannot be used, warn and return None.

        The pose of each laser on the robot is looked up only once.
        """
        settings, frame = self._settings, message.header.frame_id.removeprefix("/")
        key = settings.base_frame_id, frame
        laser = self._lasers.get(key) or self._frames.latest(*key)
        if laser is None:
            self._log.warning("no transform from %s to %s: scans are ignored", frame, settings.base_frame_id)
            return None
        self._lasers[key] = laser
        range_min, range_max = message.range_min, message.range_max
        if settings.laser_max_range > 0.0:
            range_max = min(range_max, settings.laser_max_range)
        if settings.laser_min_range > 0.0:
            range_min = max(range_min, settings.laser_min_range)
        if not range_max > 0.0 or not math.isfinite(message.angle_min + message.angle_increment):
            self._log.warning("a scan is ignored: it must have range_max > 0 and finite angles")
            return None
        # The order of two directions in the robot's frame shows whether the laser is mounted upside down.
        first = _bearing(laser, message.angle_min)
        step = math.remainder(_bearing(laser, message.angle_min + message.angle_increment) - first, math.tau)
        bearings = first + step * np.arange(len(message.ranges))
        return read_beams(np.array(message.ranges, float), bearings, laser[:2], range_min, range_max)

    def _save_if_due(self) -> None:
        now_ns, rate = self._node.clock.now_ns(), self._settings.save_pose_rate
        if rate > 0.0 and elapsed(now_ns, self._saved_ns) >= NS_PER_S / rate:
            self._saved_ns = now_ns
            self._save()

    def _save(self) -> None:
        """Store the pose as the initial pose for the next start."""
        settings, belief, correction = self._settings, self._out.belief, self._out.correction
        base = self._frames.latest(settings.odom_frame_id, settings.base_frame_id)
        if belief is None or correction is None or base is None:
            return
        saved = dict(zip(("pose_x", "pose_y", "pose_a"), flat(composed(correction, base)), strict=True))
        saved |= {"cov_xx": belief.xx, "cov_yy": belief.yy, "cov_aa": belief.aa}
        try:
            for name, value in saved.items():
                self._node.params.set(f"~initial_{name}", value)
        except Unreachable as error:  # the localization goes on without a master
            self._log.warning("the pose is not saved: %s", error)

    def _check_scans(self) -> None:
        silent_s = time.monotonic() - self._scan_s
        if silent_s > NO_SCAN_S:
            self._log.warning("no scan for %.0f s on %s", silent_s, self._node.resolve("scan"))


def _bearing(laser: Pose, angle: float) -> float:
    """Convert a beam's angle in the laser's frame to a yaw in the robot's frame."""
    return roll_pitch_yaw(composed(laser, (0.0, 0.0, 0.0, *from_roll_pitch_yaw(0.0, 0.0, angle))))[2]


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter or an argument is invalid."""
    if "--run-from-bag" in sys.argv:
        print(
            "ERROR: amcl: --run-from-bag is not supported. Try: rosparam set use_sim_time true; "
            "rosbag play --clock BAG",
            file=sys.stderr,
        )
        return 1
    return run_node("amcl", "amcl", AmclNode)
