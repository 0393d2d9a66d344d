"""The `fake_localization` program: publishes a simulated robot's true pose as if amcl had estimated it.

From `base_pose_ground_truth` and the odometry transform, it publishes `amcl_pose`, `particlecloud` and the
transform from the map frame to the odometry frame. A pose on `initialpose` shifts the estimate.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, Final

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_libraries.nodes.params import number, private
from pipros_libraries.nodes.program import run_node
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import Pose, composed, from_roll_pitch_yaw, inverted

_NS_PER_S: Final = 1_000_000_000


class FakeLocalization:
    """Publishes the estimates for one robot. Callbacks run in several threads."""

    def __init__(self, node: Node) -> None:
        """Read the parameters, and register the topics."""
        self._odom = private(node, "odom_frame_id", "odom").lstrip("/")
        self._base = private(node, "base_frame_id", "base_link").lstrip("/")
        self._map = private(node, "global_frame_id", "map").lstrip("/")
        self._tolerance_ns = round(number(node, "transform_tolerance", 0.1) * _NS_PER_S)
        x, y, yaw = (number(node, f"delta_{axis}", 0.0) for axis in ("x", "y", "yaw"))
        self._offset: Pose = (-x, -y, 0.0, *from_roll_pitch_yaw(0.0, 0.0, -yaw))
        self._log = node.log
        self._lock = threading.Lock()
        self._transforms = TransformListener(node)
        self._truth: tuple[int, Pose] | None = None
        self._is_published = True
        self._tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self._transform_class: Any = load_message_class("geometry_msgs/TransformStamped")
        self._estimate_class: Any = load_message_class("geometry_msgs/PoseWithCovarianceStamped")
        self._cloud_class: Any = load_message_class("geometry_msgs/PoseArray")
        self._pose_class: Any = load_message_class("geometry_msgs/Pose")
        self._tf = node.advertise("/tf", self._tf_class, queue_size=100)
        self._estimate = node.advertise("amcl_pose", self._estimate_class, queue_size=1, latch=True)
        self._cloud = node.advertise("particlecloud", self._cloud_class, queue_size=1, latch=True)
        self._transforms.observe(self._on_transforms)
        odometry: Any = load_message_class("nav_msgs/Odometry")
        node.subscribe("base_pose_ground_truth", odometry, self._on_truth, queue_size=1)
        node.subscribe("initialpose", self._estimate_class, self._on_initial_pose, queue_size=1)

    def _on_truth(self, message: Any) -> None:
        pose = message.pose.pose
        with self._lock:
            stamp = in_ns(message.header.stamp)
            if self._truth is not None and stamp < self._truth[0]:  # simulated time has restarted
                self._transforms.buffer.clear()
            self._truth = stamp, pose_of(pose.position, pose.orientation)
            self._is_published = False
            self._publish()

    def _on_transforms(self) -> None:
        with self._lock:
            self._publish()

    def _on_initial_pose(self, message: Any) -> None:
        frame = message.header.frame_id.lstrip("/")
        if frame not in ("", self._map):
            self._log.warning("initial poses must be in the frame %s, got one in %s", self._map, frame)
            return
        with self._lock:
            if self._truth is not None:
                pose = pose_of(message.pose.pose.position, message.pose.pose.orientation)
                self._offset = composed(pose, inverted(self._truth[1]))
                self._is_published = False
                self._publish()

    def _publish(self) -> None:
        """Publish the estimate for the newest true pose, if the odometry at its timestamp is known."""
        if self._truth is None or self._is_published:
            return
        stamp_ns, truth = self._truth
        try:
            _, base_in_odom = self._transforms.buffer.lookup(self._odom, self._base, stamp_ns)
        except TransformException:
            return
        self._is_published = True
        in_map = composed(self._offset, truth)
        odom_in_map = composed(in_map, inverted(base_in_odom))
        transform = self._transform_class(child_frame_id=self._odom)
        transform.header.frame_id = self._map
        transform.header.stamp = Time(*divmod(stamp_ns + self._tolerance_ns, _NS_PER_S))
        _fill(transform.transform.translation, transform.transform.rotation, odom_in_map)
        self._tf.publish(self._tf_class([transform]))
        estimate = self._estimate_class()
        estimate.header.frame_id, estimate.header.stamp = self._map, Time(*divmod(stamp_ns, _NS_PER_S))
        _fill(estimate.pose.pose.position, estimate.pose.pose.orientation, in_map)
        self._estimate.publish(estimate)
        particle = self._pose_class()
        _fill(particle.position, particle.orientation, in_map)
        self._cloud.publish(self._cloud_class(header=estimate.header, poses=[particle]))


def _fill(position: Any, orientation: Any, pose: Pose) -> None:
    position.x, position.y, position.z = pose[:3]
    orientation.x, orientation.y, orientation.z, orientation.w = pose[3:]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return run_node("fake_localization", "fake_localization", lambda node, *_: FakeLocalization(node), argv)
