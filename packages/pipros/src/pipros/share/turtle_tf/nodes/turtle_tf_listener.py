#!/usr/bin/env python3
"""Spawns turtle2, and steers it towards turtle1."""

import math

from geometry_msgs.msg import Twist
from turtlesim.srv import Spawn

import rospy
import tf


def follow() -> None:
    rospy.init_node("turtle_tf_listener")
    listener = tf.TransformListener()
    rospy.wait_for_service("spawn")
    rospy.ServiceProxy("spawn", Spawn)(4, 2, 0, "turtle2")
    commands = rospy.Publisher("turtle2/cmd_vel", Twist, queue_size=1)
    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        try:
            (x, y, _), _ = listener.lookupTransform("/turtle2", "/turtle1", rospy.Time(0))
        except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException):
            rate.sleep()
            continue
        command = Twist()
        command.linear.x = 0.5 * math.hypot(x, y)
        command.angular.z = 4 * math.atan2(y, x)
        commands.publish(command)
        rate.sleep()


if __name__ == "__main__":
    try:
        follow()
    except rospy.ROSInterruptException:
        pass
