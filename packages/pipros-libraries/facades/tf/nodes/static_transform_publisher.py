"""`rosrun tf static_transform_publisher`: publish a fixed transform on /tf periodically."""

from __future__ import annotations

import sys

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from tf2_ros.nodes.static_transform_publisher import transform_of
from tf2_ros.transform_broadcaster import TransformBroadcaster

USAGE = """\
Publish a fixed transform on /tf periodically.
Usage: static_transform_publisher x y z yaw pitch roll frame_id child_frame_id  period(milliseconds)
OR
Usage: static_transform_publisher x y z qx qy qz qw frame_id child_frame_id  period(milliseconds)
"""

_SHORTEST_S = 0.001


@exits_after_ctrl_c()
def main() -> int:
    """Publish the transform until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    rospy.init_node("static_transform_publisher", anonymous=True)
    try:
        if not arguments:
            raise ValueError(
                "static_transform_publisher exited due to not having the right number of arguments"
            )
        transform = transform_of(arguments[:-1])
        period = rospy.Duration(float(arguments[-1]) / 1000.0)
    except ValueError as error:
        rospy.logerr("%s", error)
        print(USAGE)
        return 255
    parent, child = transform.header.frame_id, transform.child_frame_id
    if parent == child:
        print(
            f"target_frame and source frame are the same ({parent}, {child}) this cannot work",
            file=sys.stderr,
        )
        return 1
    broadcaster = TransformBroadcaster()
    rate = rospy.Rate(1.0 / max(period.to_sec(), _SHORTEST_S), reset=True)
    while not rospy.is_shutdown():
        # timestamped for the time of the next message, so that lookups succeed until then
        transform.header.stamp = rospy.Time.now() + period
        broadcaster.sendTransform(transform)
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    return 0
