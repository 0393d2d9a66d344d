"""The node amcl: topics, services, transforms and parameters around a `Localizer`."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from pipros.libraries.reconfiguring.server import Reconfigurable, Value
from pipros.libraries.transforms.messages import in_ns, pose_of
from pipros.libraries.transforms.pose import IDENTITY, Pose, composed
from pipros.msg import load_message_class, load_service_class
from pipros.navigation.amcl.grid import GridMap
from pipros.navigation.amcl.localizer import Localizer
from pipros.navigation.amcl.publications import Publications
from pipros.navigation.amcl.scans import ScanReader
from pipros.navigation.amcl.settings import (
    LASER_MODELS,
    ODOMETRY_MODELS,
    Belief,
    Settings,
    changeable_settings,
    checked,
    read_belief,
)
from pipros.navigation.frames import Frames
from pipros.navigation.parameters import Parameters, read_parameters
from pipros.navigation.plane import flat
from pipros.navigation.schedule import Schedule
from pipros.node import Node
from pipros.node.rate import Timer
from pipros.node.service_link import ServiceFailed

NO_SCAN_S: Final = 15.0
MAP_REQUEST_S: Final = 0.5
TRANSFORM_S: Final = 2.0
"""Longest wait for the transform of a scan, in the node's time."""
INITIAL_POSE_S: Final = 0.5
"""Longest wait for the motion since the timestamp of an initial pose."""


class AmclNode:
    """Localises a robot. Callbacks run in several threads, under one lock, which is not held in waits."""

    def __init__(self, node: Node, log: logging.Logger, settings: Settings, parameters: Parameters) -> None:
        """Register topics and services. `run` gets the map, and offers the changeable settings."""
        self._node, self._log, self._settings = node, log, settings
        self._rng = np.random.default_rng(settings.seed if settings.seed >= 0 else None)
        self._lock = threading.RLock()
        self._belief = self._read_belief(parameters)
        self._grid: GridMap | None = None
        self._localizer: Localizer | None = None
        self._waiting: Belief | None = None
        self._starting: Mapping[str, Value] | None = None
        self._scan_s = time.monotonic()
        self._frames = Frames(node, log)
        self._scans = ScanReader(self._frames, log)
        self._out = Publications(node, settings)
        stamped: Any = load_message_class("geometry_msgs/PoseWithCovarianceStamped")
        scan: Any = load_message_class("sensor_msgs/LaserScan")
        self._serve("global_localization", "std_srvs/Empty", self._start_anywhere)
        self._serve("request_nomotion_update", "std_srvs/Empty", self._force_update)
        self._serve("set_map", "nav_msgs/SetMap", self._set_map)
        node.subscribe("initialpose", stamped, self._on_initial_pose, queue_size=2)
        self._subscription = node.subscribe("scan", scan, self._on_scan, queue_size=100)
        node.on_shutdown(self._save)

    def _serve(self, name: str, type_name: str, handle: Any) -> None:
        service = load_service_class(type_name)
        self._node.serve(name, service, lambda request: service._response_class(**(handle(request) or {})))

    def run(self) -> None:
        """Get the map and localise until the node is shut down. Blocks."""
        if self._settings.use_map_topic:
            grid: Any = load_message_class("nav_msgs/OccupancyGrid")
            self._node.subscribe("map", grid, self._on_map, queue_size=1)
        else:
            self._request_map()
        if self._node.is_ending:
            return
        Reconfigurable(self._node, "~", changeable_settings(), self._reconfigure)
        Schedule(self._node).start()
        Timer(self._node.clock, round(NO_SCAN_S * 1e9), lambda _: self._check_scans(), reset=True)
        self._node.wait_for_shutdown()

    # -- the map and the initial pose ------------------------------------------------

    def _request_map(self) -> None:
        service: Any = load_service_class("nav_msgs/GetMap")
        client = self._node.client("static_map", service)
        self._log.info("requesting the map from the service static_map")
        while not self._node.is_ending:
            try:
                self._use_map(client.call(service._request_class(), timeout_s=60.0).map)
            except ServiceFailed as error:
                self._log.warning("requesting the map failed: %s. Trying again", error)
            else:
                return
            self._node.wait_for_shutdown(MAP_REQUEST_S)

    def _on_map(self, message: Any) -> None:
        if not (self._settings.first_map_only and self._grid is not None):
            self._use_map(message)

    def _use_map(self, message: Any) -> None:
        info, frame = message.info, message.header.frame_id.removeprefix("/")
        if frame != self._settings.global_frame_id:
            self._log.warning("the map is in the frame %s, not %s", frame, self._settings.global_frame_id)
        if not info.resolution > 0.0 or len(message.data) != info.width * info.height or not message.data:
            self._log.error(
                "a map must have a resolution > 0 and width * height cells, got %s m, %s x %s and %s cells",
                info.resolution, info.width, info.height, len(message.data),
            )  # fmt: skip
            return
        values = np.array(message.data, np.int8).reshape(info.height, info.width)
        # The message has the resolution in single precision; amcl computes with that number as well.
        grid = GridMap(values, info.resolution, (info.origin.position.x, info.origin.position.y))
        with self._lock:
            self._grid = grid
            self._belief = self._read_belief(read_parameters(self._node))
            self._rebuild(self._belief)
            if self._waiting is not None:
                self._start_at(self._waiting)
        self._log.info("using a map of %s x %s cells of %.3f m", info.width, info.height, info.resolution)

    def _rebuild(self, belief: Belief) -> None:
        if self._grid is not None:
            self._localizer = Localizer(self._grid, self._settings, belief, self._rng)

    def _read_belief(self, parameters: Parameters) -> Belief:
        belief, ignored = read_belief(parameters)
        for name in ignored:
            self._log.warning("~%s is not a finite number: it is ignored", name)
        return belief

    def _on_initial_pose(self, message: Any) -> None:
        frame = message.header.frame_id.removeprefix("/")
        if not frame:
            self._log.warning("an initial pose without a frame is taken to be in the frame of the map")
        elif frame != self._settings.global_frame_id:
            self._log.warning(
                "initial poses must be in the frame %s, got one in %s", self._settings.global_frame_id, frame
            )
            return
        pose, covariance = message.pose.pose, message.pose.covariance
        moved = composed(
            pose_of(pose.position, pose.orientation), self._motion_since(in_ns(message.header.stamp))
        )
        (x, y, yaw), (xx, xy, yy, aa) = flat(moved), (covariance[i] for i in (0, 1, 7, 35))
        if not np.isfinite((x, y, yaw, xx, xy, yy, aa)).all():
            self._log.warning("an initial pose has numbers that are not finite: it is ignored")
            return
        with self._lock:
            self._start_at(Belief(x, y, yaw, xx, yy, aa, xy))
            if self._settings.force_update_after_initialpose and self._localizer is not None:
                self._localizer.force_update()
        self._log.info("setting the pose to %.3f %.3f %.3f", x, y, yaw)

    def _motion_since(self, stamp_ns: int) -> Pose:
        """Return the robot's pose relative to its pose at a time, or no motion if that is not known."""
        base, odom = self._settings.base_frame_id, self._settings.odom_frame_id
        pose = self._frames.motion(base, odom, stamp_ns, self._node.clock.now_ns(), INITIAL_POSE_S)
        if pose is None:
            if self._out.correction is not None:
                self._log.warning("the motion since the timestamp of an initial pose is not known")
            return IDENTITY
        return pose

    def _start_at(self, belief: Belief) -> None:
        if self._localizer is None:
            self._waiting = belief
        else:
            self._localizer.start_at(belief)
            self._waiting = None

    # -- services --------------------------------------------------------------------

    def _start_anywhere(self, _: Any) -> None:
        with self._lock:
            if self._localizer is not None:
                self._localizer.start_anywhere()
        self._log.info("the particles are spread over the whole map")

    def _force_update(self, _: Any) -> None:
        with self._lock:
            if self._localizer is not None:
                self._localizer.force_update()

    def _set_map(self, request: Any) -> dict[str, bool]:
        self._use_map(request.map)
        self._on_initial_pose(request.initial_pose)
        with self._lock:
            if self._settings.force_update_after_set_map and self._localizer is not None:
                self._localizer.force_update()
        return {"success": True}

    def _reconfigure(self, values: Mapping[str, Value], _: int) -> Mapping[str, Value] | None:
        """Use changed settings. The first call, at the start, is ignored, as in amcl."""
        if self._starting is None:
            self._starting = values
            return None
        if values["restore_defaults"]:
            values = {**self._starting, "restore_defaults": False}
        for name, models in (("laser_model_type", LASER_MODELS), ("odom_model_type", ODOMETRY_MODELS)):
            if values[name] not in models:
                self._log.warning("~%s must be one of %s", name, ", ".join(models))
        with self._lock:
            self._settings = checked(replace(self._settings, **values))  # type: ignore[arg-type]
            self._out.settings = self._settings
            self._rebuild(self._out.belief or self._belief)
        return values

    # -- scans -----------------------------------------------------------------------

    def _on_scan(self, message: Any) -> None:
        settings = self._settings
        self._scan_s = time.monotonic()
        if self._localizer is None:
            return
        stamp_ns = in_ns(message.header.stamp)
        base = self._frames.awaited(settings.odom_frame_id, settings.base_frame_id, stamp_ns, TRANSFORM_S)
        beams = self._scans.read(message, settings) if base is not None else None
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
                if self._out.is_save_due(self._node.clock.now_ns()):
                    self._save()
            self._out.publish_diagnostics()

    def _save(self) -> None:
        """Store the pose as the initial pose for the next start."""
        settings, belief, correction = self._settings, self._out.belief, self._out.correction
        if belief is None or correction is None:
            return
        found = self._frames.latest(settings.odom_frame_id, settings.base_frame_id)
        if found is None:
            return
        x, y, yaw = flat(composed(correction, found))
        saved = {"pose_x": x, "pose_y": y, "pose_a": yaw}
        saved |= {"cov_xx": belief.xx, "cov_yy": belief.yy, "cov_aa": belief.aa}
        for name, value in saved.items():
            self._node.params.set(f"~initial_{name}", value)

    def _check_scans(self) -> None:
        silent_s = time.monotonic() - self._scan_s
        if silent_s > NO_SCAN_S:
            self._log.warning("no scan for %.0f s on %s", silent_s, self._node.resolve("scan"))
