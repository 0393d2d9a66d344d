"""Publish the estimates of a filter node as messages and transforms."""

from __future__ import annotations

import logging
import time
from math import floor
from typing import Any, Final

import numpy as np

from pipros.libraries.transforms.pose import Pose, composed, from_roll_pitch_yaw, inverted
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.navigation.filter.kalman import ExtendedKalmanFilter
from pipros.navigation.filter.settings import Settings
from pipros.navigation.filter.state import ACCELERATION, POSE, RATES, TWIST, Array
from pipros.navigation.frames import Frames
from pipros.node import Node

_ERROR_S: Final = 5.0


class Estimates:
    """Publishes `odometry/filtered`, `accel/filtered` and the transform. Not thread-safe."""

    def __init__(self, node: Node, log: logging.Logger, settings: Settings, frames: Frames) -> None:
        self._log, self._settings, self._frames = log, settings, frames
        self._published_s: float | None = None
        self._error_s = -_ERROR_S
        self._odometry_class: Any = load_message_class("nav_msgs/Odometry")
        self._transform_class: Any = load_message_class("geometry_msgs/TransformStamped")
        self._tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self._accel_class: Any = load_message_class("geometry_msgs/AccelWithCovarianceStamped")
        self._odometry = node.advertise("odometry/filtered", self._odometry_class, queue_size=20)
        self._tf = node.advertise("/tf", self._tf_class, queue_size=100) if settings.publishes_tf else None
        self._accel = None
        if settings.publishes_acceleration:
            self._accel = node.advertise("accel/filtered", self._accel_class, queue_size=20)

    def reset(self) -> None:
        """Publish the next estimate whatever its time."""
        self._published_s = None

    def publish(self, time_s: float, kalman: ExtendedKalmanFilter, angular: Array, interval_s: float) -> bool:
        """Publish the estimate, unless its time was published before. Return whether it was published.

        `angular` is the angular acceleration, a difference over `interval_s`.
        """
        is_old = self._published_s is not None and time_s <= self._published_s
        if is_old and not self._settings.publishes_corrections:
            return False
        if not np.isfinite(kalman.state).all() or not np.isfinite(kalman.covariance).all():
            self._complain("the estimate is not finite: check the covariances of the inputs")
            return False
        self._published_s = time_s
        stamp = in_time(time_s)
        state = kalman.state
        pose: Pose = (*state[:3].tolist(), *from_roll_pitch_yaw(*state[3:6].tolist()))
        self._publish_transform(time_s, pose)
        odometry = self._odometry_class(child_frame_id=self._settings.base_frame_output)
        odometry.header.frame_id, odometry.header.stamp = self._settings.world_frame, stamp
        _fill(odometry.pose.pose.position, odometry.pose.pose.orientation, pose)
        _fill_six(odometry.twist.twist, state[TWIST])
        odometry.pose.covariance = kalman.covariance[POSE, POSE].ravel().tolist()
        odometry.twist.covariance = kalman.covariance[TWIST, TWIST].ravel().tolist()
        self._odometry.publish(odometry)
        if self._accel is not None:
            accel = self._accel_class()
            accel.header.frame_id, accel.header.stamp = self._settings.base_frame_output, stamp
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
        parent, child, pose = settings.world_frame, settings.base_frame_output, base
        if settings.world_frame == settings.map_frame:
            stamp_ns = in_time(time_s).to_nsec()
            odom = self._frames.find(
                settings.odom_frame, settings.base_frame, stamp_ns, settings.tf_timeout_s
            )
            if odom is None:
                self._complain(
                    f"no transform from {settings.base_frame} to {settings.odom_frame}: none is sent"
                )
                return
            child, pose = settings.odom_frame, composed(base, inverted(odom))
        elif settings.world_frame != settings.odom_frame:
            self._complain("world_frame must be map_frame or odom_frame: no transform is sent")
            return
        if settings.inverts_tf:
            parent, child, pose = child, parent, inverted(pose)
        transform = self._transform_class(child_frame_id=child)
        transform.header.frame_id = parent
        transform.header.stamp = in_time(time_s + settings.tf_offset_s)
        _fill(transform.transform.translation, transform.transform.rotation, pose)
        self._tf.publish(self._tf_class([transform]))

    def _complain(self, text: str) -> None:
        if time.monotonic() - self._error_s >= _ERROR_S:
            self._error_s = time.monotonic()
            self._log.error("%s", text)


def in_time(time_s: float) -> Time:
    """Return a time in floating point as ROS time, with the rounding of roscpp's `fromSec`."""
    whole = floor(time_s)
    return Time(*divmod(whole * 1_000_000_000 + round((time_s - whole) * 1e9), 1_000_000_000))


def _fill(position: Any, orientation: Any, pose: Pose) -> None:
    position.x, position.y, position.z = pose[:3]
    orientation.x, orientation.y, orientation.z, orientation.w = pose[3:]


def _fill_six(message: Any, values: Array) -> None:
    line, turn = message.linear, message.angular
    line.x, line.y, line.z, turn.x, turn.y, turn.z = values.tolist()
