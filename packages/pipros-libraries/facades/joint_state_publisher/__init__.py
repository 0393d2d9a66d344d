"""Drop-in replacement for Noetic's joint_state_publisher: publish default or received joint values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import JointState

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.names import valid_topics
from pipros_libraries.robot_model.joint_values import JointChoices, JointValues, MimicCircle
from pipros_libraries.robot_model.urdf import UrdfError, read_robot


def get_param(name: str, value: Any = None) -> Any:
    """Return the private parameter `name`. Fall back to the node's namespace, then to `value`."""
    for wanted in (f"~{name}", name):
        if rospy.has_param(wanted):
            return rospy.get_param(wanted)
    return value


class JointStatePublisher:
    """Publisher of `joint_states` for the robot described in the parameter `robot_description`.

    The attributes `free_joints`, `joint_list` and `dependent_joints` hold the joints and may be modified.

    Raises:
        RuntimeError: `robot_description` is not set, or not a valid URDF.
        SystemExit: the `mimic` references between joints form a cycle.
    """

    def __init__(self) -> None:
        description = get_param("robot_description")
        if description is None:
            raise RuntimeError("The robot_description parameter is required and not set.")
        choices = JointChoices(
            get_param("zeros", {}),
            get_param("dependent_joints", {}),
            get_param("use_mimic_tags", True),
            get_param("use_smallest_joint_limits", True),
            get_param("publish_default_positions", True),
            get_param("publish_default_velocities", False),
            get_param("publish_default_efforts", False),
        )
        try:
            self._values = JointValues(read_robot(str(description)), choices)
        except UrdfError as error:
            raise RuntimeError(f"robot_description: {error}") from error
        except MimicCircle as error:
            rospy.logerr("%s", error)
            raise SystemExit(1) from error
        for problem in self._values.problems:
            rospy.logerr("%s; it is left out", problem)
        for name in self._values.without_limits:
            rospy.logwarn("%s is not fixed, nor continuous, but limits are not specified!", name)
        self.free_joints = self._values.free
        self.joint_list = self._values.names
        self.dependent_joints = self._values.dependent
        self.source_update_cb: Callable[[], object] | None = None
        self.sources = [
            rospy.Subscriber(source, JointState, self.source_cb)
            for source in valid_topics("source_list", get_param("source_list", []), rospy.logerr)
        ]
        self.pub = rospy.Publisher("joint_states", JointState, queue_size=5)

    def source_cb(self, msg: Any) -> None:
        """Handle a message on one of the topics in `source_list`."""
        self._values.update(msg.name, position=msg.position, velocity=msg.velocity, effort=msg.effort)
        if self.source_update_cb is not None:
            self.source_update_cb()

    def set_source_update_cb(self, user_cb: Callable[[], object]) -> None:
        """Set a function to call without arguments after each message on the topics in `source_list`."""
        self.source_update_cb = user_cb

    def loop(self) -> None:
        """Publish until the node is shut down."""
        rate = rospy.Rate(get_param("rate", 10), reset=True)
        delta = get_param("delta", 0.0)
        while not rospy.is_shutdown():
            if delta > 0:
                self.update(delta)
            message = JointState(name=list(self.joint_list))
            message.header.stamp = rospy.Time.now()
            message.position, message.velocity, message.effort = self._values.columns()
            if message.name:
                self.pub.publish(message)
            rate.sleep()

    def update(self, delta: float) -> None:
        """Move each free joint with a known position by `delta` (radians or metres).

        Continuous joints move only forward; other joints move back and forth within their range.
        """
        self._values.sweep(delta)


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("joint_state_publisher")
    try:
        publisher = JointStatePublisher()
    except RuntimeError as error:
        rospy.logfatal("joint_state_publisher cannot start: %s", error)
        return 1
    publisher.loop()
    return 0
