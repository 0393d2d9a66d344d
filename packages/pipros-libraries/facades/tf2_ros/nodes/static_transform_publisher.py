"""`rosrun tf2_ros static_transform_publisher`: publish a static transform on /tf_static."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.transforms.pose import from_roll_pitch_yaw
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster

USAGE = """\
Publish a static transform on /tf_static.
Usage: static_transform_publisher x y z qx qy qz qw frame_id child_frame_id
OR
Usage: static_transform_publisher x y z yaw pitch roll frame_id child_frame_id
OR
Usage: static_transform_publisher /param_name
"""


def transform_of(arguments: Sequence[str]) -> TransformStamped:
    """Parse a transform from six or seven numbers and two frame IDs.

    Raises:
        ValueError: the number of arguments is wrong, or a value is not a number.
    """
    if len(arguments) not in (8, 9):
        raise ValueError("static_transform_publisher exited due to not having the right number of arguments")
    *texts, parent, child = arguments
    numbers = [float(text) for text in texts]
    if len(numbers) == 6:
        yaw, pitch, roll = numbers[3:]
        quaternion = from_roll_pitch_yaw(roll, pitch, yaw)
    else:
        quaternion = (numbers[3], numbers[4], numbers[5], numbers[6])
    pose = Transform(Vector3(*numbers[:3]), Quaternion(*quaternion))
    return TransformStamped(Header(frame_id=parent), child, pose)


def transform_of_param(value: Any) -> TransformStamped:
    """Parse a transform from a parameter, which is a mapping with the fields of a TransformStamped.

    Raises:
        ValueError: a field is missing or not a number.
    """
    try:
        translation, rotation = value["transform"]["translation"], value["transform"]["rotation"]
        position = Vector3(*(float(translation[axis]) for axis in "xyz"))
        quaternion = Quaternion(*(float(rotation[axis]) for axis in "xyzw"))
        header = Header(frame_id=str(value["header"]["frame_id"]))
        return TransformStamped(header, str(value["child_frame_id"]), Transform(position, quaternion))
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"the parameter must have the fields of a TransformStamped: missing or invalid {error}"
        ) from error


@exits_after_ctrl_c()
def main() -> int:
    """Publish the transform until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    rospy.init_node("static_transform_publisher", anonymous=True)
    try:
        if len(arguments) == 1:
            transform = transform_of_param(rospy.get_param(arguments[0]))
        else:
            transform = transform_of(arguments)
    except KeyError:
        rospy.logfatal("Could not read TF from parameter server: %s is not set", arguments[0])
        return 255
    except ValueError as error:
        print(USAGE, file=sys.stderr)
        rospy.logerr("%s", error)
        return 255
    parent, child = transform.header.frame_id, transform.child_frame_id
    if parent == child:
        rospy.logfatal("target_frame and source frame are the same (%s, %s) this cannot work", parent, child)
        return 1
    transform.header.stamp = rospy.Time.now()
    broadcaster = StaticTransformBroadcaster()
    broadcaster.sendTransform(transform)
    rospy.loginfo("Spinning until killed publishing %s to %s", parent, child)
    rospy.spin()
    return 0
