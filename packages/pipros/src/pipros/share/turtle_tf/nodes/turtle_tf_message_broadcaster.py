#!/usr/bin/env python3
"""Spawns turtle3, drives it in a circle, and publishes its position as `turtle_point_stamped`."""

from geometry_msgs.msg import PointStamped, Twist
from turtlesim.msg import Pose
from turtlesim.srv import Spawn

import rospy


def send(pose: Pose) -> None:
    point = PointStamped()
    point.header.stamp = rospy.Time.now()
    point.header.frame_id = "world"
    point.point.x, point.point.y = pose.x, pose.y
    points.publish(point)
    circle = Twist()
    circle.linear.x = circle.angular.z = 1.0
    commands.publish(circle)


if __name__ == "__main__":
    try:
        rospy.init_node("turtle_tf_message_broadcaster")
        name = rospy.get_param("~turtle", "turtle3")
        rospy.wait_for_service("spawn")
        rospy.ServiceProxy("spawn", Spawn)(4, 2, 0, name)
        points = rospy.Publisher("turtle_point_stamped", PointStamped, queue_size=1)
        commands = rospy.Publisher(f"{name}/cmd_vel", Twist, queue_size=1)
        rospy.Subscriber(f"{name}/pose", Pose, send, queue_size=1)
        rospy.spin()
    except rospy.ROSInterruptException:
        pass
