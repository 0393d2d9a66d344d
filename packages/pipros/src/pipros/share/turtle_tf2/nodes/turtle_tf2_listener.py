#!/usr/bin/env python3
"""Spawns a turtle, by default turtle2, and steers it towards turtle1."""

import math

from geometry_msgs.msg import Twist
from turtlesim.srv import Spawn

import rospy
import tf2_ros


def follow() -> None:
    rospy.init_node("tf2_turtle_listener")
    buffer = tf2_ros.Buffer()
    tf2_ros.TransformListener(buffer)
    rospy.wait_for_service("spawn")
    turtle = rospy.get_param("turtle", "turtle2")
    rospy.ServiceProxy("spawn", Spawn)(4, 2, 0, turtle)
    commands = rospy.Publisher(f"{turtle}/cmd_vel", Twist, queue_size=1)
    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        try:
            to_it = buffer.lookup_transform(turtle, "turtle1", rospy.Time()).transform.translation
        except (tf2_ros.LookupException, tf2_ros.ConnectivityException, tf2_ros.ExtrapolationException):
            rate.sleep()
            continue
        command = Twist()
        command.linear.x = 0.5 * math.hypot(to_it.x, to_it.y)
        command.angular.z = 4 * math.atan2(to_it.y, to_it.x)
        commands.publish(command)
        rate.sleep()


if __name__ == "__main__":
    try:
        follow()
    except rospy.ROSInterruptException:
        pass
