"""Publish the estimates of amcl as messages, transforms and diagnostics."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros_libraries.nodes.wiring import advertise, stamped
from pipros_libraries.transforms.pose import Pose, composed, inverted
from pipros_robot.navigation import plane
from pipros_robot.navigation.amcl.localizer import Estimate
from pipros_robot.navigation.amcl.settings import AmclSettings, Belief
from pipros_robot.navigation.plane import Poses

_DIAGNOSTICS_S = 1.0
_ESTIMATE = "geometry_msgs/PoseWithCovarianceStamped"


class Publications:
    """Publishes `amcl_pose`, `particlecloud`, the transform and `/diagnostics`. Not thread-safe.

    Attributes:
        belief: the last published estimate.
        correction: the pose of the odometry frame in the global frame; None before the first estimate.
    """

    def __init__(self, node: Node, settings: AmclSettings) -> None:
        self.settings = settings
        self.belief: Belief | None = None
        self.correction: Pose | None = None
        self._diagnosed_s = -_DIAGNOSTICS_S
        self._name = node.name.lstrip("/")
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100)
        self._estimates = advertise(node, "amcl_pose", _ESTIMATE, 2, latch=True)
        self._clouds = advertise(node, "particlecloud", "geometry_msgs/PoseArray", 2, latch=True)
        self._diagnostics = LinkDiagnostics(node, "None")

    def publish_cloud(self, poses: Poses, now_ns: int) -> None:
        """Publish the particles, with the current time."""
        cloud = stamped("geometry_msgs/PoseArray", self.settings.global_frame_id, now_ns)
        cloud.poses = plane.PoseMessages(poses)
        self._clouds.publish(cloud)

    def publish_estimate(self, estimate: Estimate, stamp_ns: int, base: Pose) -> None:
        """Publish an estimate and the transform, for the time `stamp_ns`.

        `base` is the robot's pose in the odometry frame at this time.
        """
        message = stamped(_ESTIMATE, self.settings.global_frame_id, stamp_ns)
        (message.pose.pose,) = plane.pose_messages([estimate.pose])
        covariance: Any = np.zeros((6, 6))
        covariance[:2, :2], covariance[5, 5] = estimate.covariance[:2, :2], estimate.covariance[2, 2]
        message.pose.covariance = covariance.ravel().tolist()
        self._estimates.publish(message)
        self.belief = Belief(*estimate.pose, *estimate.covariance.diagonal().tolist())
        self.correction = composed(plane.raised(estimate.pose), inverted(base))
        self.publish_transform(stamp_ns)

    def publish_transform(self, stamp_ns: int) -> None:
        """Publish the last correction as a transform, dated `transform_tolerance` after `stamp_ns`."""
        settings = self.settings
        if self.correction is not None and settings.tf_broadcast:
            valid_ns = stamp_ns + round(settings.transform_tolerance * NS_PER_S)
            frames = settings.global_frame_id, settings.odom_frame_id
            self._tf.publish(plane.transforms(*frames, self.correction, valid_ns))

    def publish_diagnostics(self) -> None:
        """Publish the standard deviations, at most once per second."""
        belief, settings, now_s = self.belief, self.settings, time.monotonic()
        if belief is None or now_s - self._diagnosed_s < _DIAGNOSTICS_S:
            return
        self._diagnosed_s = now_s
        values: dict[str, str] = {}
        is_large = False
        for axis, variance, limit in (
            ("x", belief.xx, settings.std_warn_level_x),
            ("y", belief.yy, settings.std_warn_level_y),
            ("yaw", belief.aa, settings.std_warn_level_yaw),
        ):
            deviation = math.sqrt(max(0.0, variance))
            values |= {f"std_{axis}": f"{deviation:g}", f"std_warn_level_{axis}": f"{limit:g}"}
            is_large |= deviation > limit
        level, text = (LinkLevel.WARN, "Too large") if is_large else (LinkLevel.OK, "OK")
        self._diagnostics.publish([LinkStatus(f"{self._name}: Standard deviation", level, text, values)])
