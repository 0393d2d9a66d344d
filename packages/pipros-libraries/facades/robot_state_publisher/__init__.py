"""`rosrun robot_state_publisher robot_state_publisher`: publish the frames of a robot's links.

Parameters: `robot_description`, `~publish_frequency` (50 Hz), `~use_tf_static` (true),
`~ignore_timestamp` (false), `tf_prefix`. Input: `joint_states`. Outputs: `/tf` and `/tf_static`.
"""

from __future__ import annotations

import sys
from threading import Lock
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg.time import NS_PER_S
from pipros_libraries.robot_model.joint_poses import JointFrames, pose_of
from pipros_libraries.robot_model.urdf import Joint, Robot, UrdfError, read_robot
from pipros_libraries.transforms.pose import Pose
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster

_MAX_AGE_S = 30.0
"""Age of a JointState message above which a warning is logged."""

_SHORTEST_PERIOD_S = 0.001
"""Minimum interval between two messages. Without it, a timer with a frequency of 1e12 would never sleep."""


class RobotStatePublisher:
    """Publisher of the frames of `robot`, computed from the messages on `joint_states`.

    Args:
        frequency: maximum rate in Hz; values below 1 are treated as 1. If `use_tf_static` is false, fixed
            joints are published at this rate.
        use_tf_static: whether to publish fixed joints on `/tf_static`.
        ignore_timestamp: whether to publish frames for every message, instead of limiting the rate by
            timestamp.
        tf_prefix: prefix of all frame IDs; a slash is appended to it.
    """

    def __init__(
        self,
        robot: Robot,
        frequency: float = 50.0,
        use_tf_static: bool = True,
        ignore_timestamp: bool = False,
        tf_prefix: str = "",
    ) -> None:
        self._frames = JointFrames(robot, int(NS_PER_S / max(frequency, 1.0)), ignore_timestamp)
        self._prefix = f"{tf_prefix.strip('/')}/" if tf_prefix.strip("/") else ""
        self._lock = Lock()
        self._last_call = rospy.Time.now()
        for joint in self._frames.floating:
            rospy.logwarn(
                "Joint %s is floating: the pose of %s cannot be published.", joint.name, joint.child
            )
        self._broadcaster = TransformBroadcaster()
        self._subscriber = rospy.Subscriber(
            "joint_states", JointState, self.on_joints, queue_size=1, tcp_nodelay=True
        )
        self._timer: Any = None
        if use_tf_static:
            self._static = StaticTransformBroadcaster()
            if self._frames.fixed:
                self._static.sendTransform(self._fixed(rospy.Time.now()))
        else:
            period = rospy.Duration(max(self._frames.interval / NS_PER_S, _SHORTEST_PERIOD_S))
            self._timer = rospy.Timer(period, self._on_timer, reset=True)

    def on_joints(self, message: Any) -> None:
        """Handle a message on `joint_states`."""
        if len(message.name) != len(message.position):
            if message.position:
                rospy.logerr(
                    "Robot state publisher ignored a JointState message with %d names and %d positions",
                    len(message.name),
                    len(message.position),
                )
            else:
                rospy.logwarn_throttle(
                    10.0,
                    f"Robot state publisher ignored a JointState message about the joints {message.name}: "
                    "it has no positions",
                )
            return
        with self._lock:
            now = rospy.Time.now()
            if now < self._last_call:
                rospy.logwarn("Clock jumped back: publishing all joints again.")
                self._frames.forget_times()
            self._last_call = now
            age = (now - message.header.stamp).to_sec()
            if age > _MAX_AGE_S:
                rospy.logwarn_throttle(10.0, f"The received JointState is {age:f} seconds old.")
            due = self._frames.due(message.name, message.position, message.header.stamp.to_nsec())
        if due:
            stamp = message.header.stamp
            self._broadcaster.sendTransform([self._transform(joint, pose, stamp) for joint, pose in due])

    def _on_timer(self, _event: Any) -> None:
        if self._frames.fixed:
            # As in Noetic, the timestamp is in the future, so that lookups succeed until the next message.
            self._broadcaster.sendTransform(self._fixed(rospy.Time.now() + rospy.Duration(0.5)))

    def _fixed(self, stamp: Any) -> list[Any]:
        return [self._transform(joint, pose_of(joint, 0.0), stamp) for joint in self._frames.fixed]

    def _transform(self, joint: Joint, pose: Pose, stamp: Any) -> Any:
        header = Header(stamp=stamp, frame_id=self._prefix + joint.parent)
        transform = Transform(Vector3(*pose[:3]), Quaternion(*pose[3:]))
        return TransformStamped(header, self._prefix + joint.child, transform)


@exits_after_ctrl_c()
def main(name: str = "robot_state_publisher") -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node(name)
    if name == "state_publisher":
        rospy.logwarn("state_publisher is deprecated: use robot_state_publisher instead.")
    where = rospy.search_param("robot_description") or "robot_description"
    description = rospy.get_param(where, None)
    if description is None:
        rospy.logfatal(
            "robot_state_publisher requires the parameter %s, which is not set", rospy.resolve_name(where)
        )
        return 1
    try:
        robot = read_robot(str(description))
    except UrdfError as error:
        rospy.logfatal("robot_state_publisher cannot use the parameter %s: %s", where, error)
        return 1
    prefix = rospy.search_param("tf_prefix")
    publisher = RobotStatePublisher(
        robot,
        float(rospy.get_param("~publish_frequency", 50.0)),
        bool(rospy.get_param("~use_tf_static", True)),
        bool(rospy.get_param("~ignore_timestamp", False)),
        str(rospy.get_param(prefix)) if prefix else "",
    )
    rospy.spin()
    del publisher
    return 0


if __name__ == "__main__":
    sys.exit(main())
