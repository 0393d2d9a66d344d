"""Publish the estimates of a filter node as messages and transforms."""

from __future__ import annotations

import logging
from math import floor
from typing import Any

import numpy as np

from pipros.basics.throttle import Throttle
from pipros.msg.time import Time
from pipros.node import Node
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.wiring import advertise, stamped
from pipros_libraries.transforms.pose import Pose, composed, from_roll_pitch_yaw, inverted
from pipros_robot.navigation import plane
from pipros_robot.navigation.filter.kalman import ExtendedKalmanFilter
from pipros_robot.navigation.filter.settings import FilterSettings
from pipros_robot.navigation.filter.state import ACCELERATION, POSE, RATES, TWIST, Array


class Estimates:
    """Publishes `odometry/filtered`, `accel/filtered` and the transform. Not thread-safe."""

    def __init__(self, node: Node, log: logging.Logger, settings: FilterSettings, frames: Frames) -> None:
        self._log, self._settings, self._frames = Throttle(log, 5.0), settings, frames
        self._published_s: float | None = None
        self._odometry = advertise(node, "odometry/filtered", "nav_msgs/Odometry", 20)
        self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100) if settings.publish_tf else None
        accel = "geometry_msgs/AccelWithCovarianceStamped"
        self._accel = advertise(node, "accel/filtered", accel, 20) if settings.publish_acceleration else None

    def reset(self) -> None:
        """Allow the next estimate to be older than the last published one."""
        self._published_s = None

    def publish(self, time_s: float, kalman: ExtendedKalmanFilter, angular: Array, interval_s: float) -> bool:
        """Publish the estimate. Return False if it is not finite, or not newer than the last estimate.

        With `permit_corrected_publication`, an estimate that is not newer is also published.

        `angular` is the angular acceleration, computed as a difference over `interval_s`.
        """
        is_old = self._published_s is not None and time_s <= self._published_s
        if is_old and not self._settings.permit_corrected_publication:
            return False
        if not np.isfinite(kalman.state).all() or not np.isfinite(kalman.covariance).all():
            self._log.error("the estimate is not finite: check the covariances of the inputs")
            return False
        self._published_s = time_s
        stamp, state, settings = in_time(time_s), kalman.state, self._settings
        pose: Pose = (*state[:3].tolist(), *from_roll_pitch_yaw(*state[3:6].tolist()))
        self._publish_transform(time_s, pose)
        odometry = stamped("nav_msgs/Odometry", settings.world_frame, stamp)
        odometry.child_frame_id = settings.base_link_frame_output
        plane.fill(odometry.pose.pose.position, odometry.pose.pose.orientation, pose)
        _fill_six(odometry.twist.twist, state[TWIST])
        odometry.pose.covariance = kalman.covariance[POSE, POSE].ravel().tolist()
        odometry.twist.covariance = kalman.covariance[TWIST, TWIST].ravel().tolist()
        self._odometry.publish(odometry)
        if self._accel is not None:
            accel = stamped(
                "geometry_msgs/AccelWithCovarianceStamped", settings.base_link_frame_output, stamp
            )
            _fill_six(accel.accel.accel, np.concatenate([state[ACCELERATION], angular]))
            covariance = np.zeros((6, 6))
            covariance[:3, :3] = kalman.covariance[ACCELERATION, ACCELERATION]
            if interval_s > 0:
                covariance[3:, 3:] = kalman.covariance[RATES, RATES] * 2 / interval_s**2
            accel.accel.covariance = covariance.ravel().tolist()
            self._accel.publish(accel)
        return True

    def _publish_transform(self, time_s: float, base: Pose) -> None:
        if self._tf is None:
            return
        settings = self._settings
        parent, child, pose = settings.world_frame, settings.base_link_frame_output, base
        if settings.world_frame == settings.map_frame:
            stamp_ns = in_time(time_s).to_nsec()
            frames = settings.odom_frame, settings.base_link_frame
            odom = self._frames.find(*frames, stamp_ns, settings.transform_timeout)
            if odom is None:
                self._log.error("cannot send the transform: no transform from %s to %s", *frames[::-1])
                return
            child, pose = settings.odom_frame, composed(base, inverted(odom))
        elif settings.world_frame != settings.odom_frame:
            text = "no transform is sent: world_frame must be map_frame or odom_frame, got %s"
            self._log.error(text, settings.world_frame)
            return
        if settings.invert_tf:
            parent, child, pose = child, parent, inverted(pose)
        stamp = in_time(time_s + settings.transform_time_offset)
        self._tf.publish(plane.transforms(parent, child, pose, stamp))


def in_time(time_s: float) -> Time:
    """Convert floating-point seconds to ROS time, with the rounding of roscpp's `fromSec`."""
    whole = floor(time_s)
    return Time(*divmod(whole * 1_000_000_000 + round((time_s - whole) * 1e9), 1_000_000_000))


def _fill_six(message: Any, values: Array) -> None:
    line, turn = message.linear, message.angular
    line.x, line.y, line.z, turn.x, turn.y, turn.z = values.tolist()
