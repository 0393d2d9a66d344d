#!/usr/bin/env python3
"""Broadcasts the pose of the turtle `~turtle` as the transform from `world` to a frame with the same name."""

import math

from turtlesim.msg import Pose

import rospy
import tf


def send(pose: Pose, turtle: str) -> None:
    broadcaster.sendTransform(
        (pose.x, pose.y, 0),
        (0.0, 0.0, math.sin(pose.theta / 2), math.cos(pose.theta / 2)),
        rospy.Time.now(),
        turtle,
        "world",
    )


if __name__ == "__main__":
    rospy.init_node("turtle_tf_broadcaster")
    broadcaster = tf.TransformBroadcaster()
    name = rospy.get_param("~turtle")
    rospy.Subscriber(f"/{name}/pose", Pose, send, name)
    rospy.spin()
