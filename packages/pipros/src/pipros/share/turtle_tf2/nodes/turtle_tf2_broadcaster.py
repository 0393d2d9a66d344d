#!/usr/bin/env python3
"""Broadcasts the pose of the turtle `~turtle` as the transform from `world` to a frame with the same name."""

import math

from geometry_msgs.msg import TransformStamped
from turtlesim.msg import Pose

import rospy
import tf2_ros


def send(pose: Pose, turtle: str) -> None:
    transform = TransformStamped()
    transform.header.stamp = rospy.Time.now()
    transform.header.frame_id = "world"
    transform.child_frame_id = turtle
    transform.transform.translation.x = pose.x
    transform.transform.translation.y = pose.y
    transform.transform.rotation.z = math.sin(pose.theta / 2)
    transform.transform.rotation.w = math.cos(pose.theta / 2)
    broadcaster.sendTransform(transform)


if __name__ == "__main__":
    rospy.init_node("tf2_turtle_broadcaster")
    broadcaster = tf2_ros.TransformBroadcaster()
    name = rospy.get_param("~turtle")
    rospy.Subscriber(f"/{name}/pose", Pose, send, name)
    rospy.spin()
