"""Publish the estimates of amcl as messages, transforms and diagnostics."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipros.libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros.libraries.transforms.pose import Pose, composed, inverted
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.navigation import plane
from pipros.navigation.amcl.localizer import Estimate
from pipros.navigation.amcl.settings import Belief, Settings
from pipros.node import Node

_DIAGNOSTICS_S = 1.0


class Publications:
    """Publishes `amcl_pose`, `particlecloud`, the transform and `/diagnostics`. Not thread-safe.

    Attributes:
        belief: the estimate that was published last.
        correction: the pose of the odometry frame in the global frame, after the first estimate.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        self.settings = settings
        self.belief: Belief | None = None
        self.correction: Pose | None = None
        self._saved_ns = 0
        self._diagnosed_s = -_DIAGNOSTICS_S
        self._name = node.name.lstrip("/")
        self._pose_class: Any = load_message_class("geometry_msgs/Pose")
        self._estimate_class: Any = load_message_class("geometry_msgs/PoseWithCovarianceStamped")
        self._cloud_class: Any = load_message_class("geometry_msgs/PoseArray")
        self._tf = node.advertise("/tf", load_message_class("tf2_msgs/TFMessage"), queue_size=100)
        self._estimates = node.advertise("amcl_pose", self._estimate_class, queue_size=2, latch=True)
        self._clouds = node.advertise("particlecloud", self._cloud_class, queue_size=2, latch=True)
        self._diagnostics = LinkDiagnostics(node, "None")

    def publish_cloud(self, poses: NDArray[np.float64], now_ns: int) -> None:
        """Publish the particles, with the current time."""
        cloud = self._cloud_class()
        cloud.header.frame_id, cloud.header.stamp = self.settings.global_frame_id, plane.time_of(now_ns)
        halves = poses[:, 2] / 2.0
        rows = np.stack((poses[:, 0], poses[:, 1], np.sin(halves), np.cos(halves)), axis=1).tolist()
        for x, y, sine, cosine in rows:
            pose = self._pose_class()
            pose.position.x, pose.position.y = x, y
            pose.orientation.z, pose.orientation.w = sine, cosine
            cloud.poses.append(pose)
        self._clouds.publish(cloud)

    def publish_estimate(self, estimate: Estimate, stamp_ns: int, base: Pose) -> None:
        """Publish an estimate for a time, and the transform that follows from the odometry pose `base`."""
        x, y, yaw = estimate.pose
        pose = plane.raised(estimate.pose)
        message = self._estimate_class()
        message.header.frame_id, message.header.stamp = self.settings.global_frame_id, plane.time_of(stamp_ns)
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        place.x, place.y = x, y
        turn.x, turn.y, turn.z, turn.w = pose[3:]
        covariance = np.zeros((6, 6))
        covariance[:2, :2], covariance[5, 5] = estimate.covariance[:2, :2], estimate.covariance[2, 2]
        message.pose.covariance = covariance.ravel().tolist()
        self._estimates.publish(message)
        xx, yy, aa = estimate.covariance.diagonal().tolist()
        self.belief = Belief(x, y, yaw, xx, yy, aa)
        self.correction = composed(pose, inverted(base))
        self.publish_transform(stamp_ns)

    def publish_transform(self, stamp_ns: int) -> None:
        """Publish the last correction for a time, which `transform_tolerance` moves into the future."""
        if self.correction is None or not self.settings.tf_broadcast:
            return
        settings = self.settings
        valid_ns = stamp_ns + round(settings.transform_tolerance * NS_PER_S)
        frames = settings.global_frame_id, settings.odom_frame_id
        self._tf.publish(plane.transforms(*frames, self.correction, valid_ns))

    def is_save_due(self, now_ns: int) -> bool:
        """Return whether the pose must be saved now; it then counts as saved."""
        rate = self.settings.save_pose_rate
        if not rate > 0.0 or now_ns - self._saved_ns < NS_PER_S / rate:
            return False
        self._saved_ns = now_ns
        return True

    def publish_diagnostics(self) -> None:
        """Publish the standard deviations, at most once per second."""
        if self.belief is None or time.monotonic() - self._diagnosed_s < _DIAGNOSTICS_S:
            return
        self._diagnosed_s = time.monotonic()
        deviations = [math.sqrt(max(0.0, each)) for each in (self.belief.xx, self.belief.yy, self.belief.aa)]
        settings = self.settings
        limits = settings.std_warn_level_x, settings.std_warn_level_y, settings.std_warn_level_yaw
        values = {}
        for axis, deviation, limit in zip(("x", "y", "yaw"), deviations, limits, strict=True):
            values[f"std_{axis}"] = f"{deviation:g}"
            values[f"std_warn_level_{axis}"] = f"{limit:g}"
        is_large = any(each > limit for each, limit in zip(deviations, limits, strict=True))
        level, text = (LinkLevel.WARN, "Too large") if is_large else (LinkLevel.OK, "OK")
        self._diagnostics.publish([LinkStatus(f"{self._name}: Standard deviation", level, text, values)])
