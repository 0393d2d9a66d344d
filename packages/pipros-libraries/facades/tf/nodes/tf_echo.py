"""`rosrun tf tf_echo`: print the transform between two frames periodically."""

from __future__ import annotations

import math

import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.printable import listed
from pipros_libraries.transforms.formatting import pose_as_text
from pipros_libraries.transforms.messages import pose_of_transform
from tf.transformer import strip_leading_slash

USAGE = """\
Usage: tf_echo source_frame target_frame [echo_rate]

This will echo the transform from the coordinate frame of the source_frame
to the coordinate frame of the target_frame.
Note: This is the transform to get data from target_frame into the source_frame.
Default echo rate is 1 if echo_rate is not given."""


def _echo(buffer: tf2_ros.Buffer, source: str, target: str) -> str:
    try:
        found = buffer.lookup_transform(source, target, rospy.Time())
    except tf2_ros.TransformException as error:
        return f"Failure at {rospy.get_time():.6f}\nException thrown:{listed(error)}"
    return f"At time {found.header.stamp.to_sec():.3f}\n{pose_as_text(pose_of_transform(found.transform))}"


@exits_after_ctrl_c()
def main() -> int:
    """Print transforms until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) not in (2, 3):
        print(USAGE)
        return 255
    source, target = map(strip_leading_slash, arguments[:2])
    try:
        hz = float(arguments[2]) if len(arguments) == 3 else 1.0
    except ValueError:
        hz = 0.0
    if not 0.0 < hz < math.inf:
        print(f"echo_rate must be a finite number > 0, got {arguments[2]}")
        return 255
    rospy.init_node("tf_echo", anonymous=True)
    buffer = tf2_ros.Buffer(debug=False)
    listener = tf2_ros.TransformListener(buffer)
    try:
        buffer.can_transform(source, target, rospy.Time(), rospy.Duration(1.0))
        rate = rospy.Rate(hz, reset=True)
        while not rospy.is_shutdown():
            print(_echo(buffer, source, target), flush=True)
            rate.sleep()
    except rospy.ROSInterruptException:
        pass
    listener.unregister()
    return 0
