#!/usr/bin/env python3
"""Broadcasts the frame `carrot1`, which circles around turtle1 every two seconds."""

import math

from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros


def send() -> None:
    rospy.init_node("dynamic_tf2_broadcaster")
    broadcaster = tf2_ros.TransformBroadcaster()
    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        transform = TransformStamped()
        transform.header.stamp = rospy.Time.now()
        transform.header.frame_id = "turtle1"
        transform.child_frame_id = "carrot1"
        angle = math.pi * rospy.Time.now().to_sec()
        transform.transform.translation.x, transform.transform.translation.y = (
            2.0 * math.sin(angle),
            2.0 * math.cos(angle),
        )
        transform.transform.rotation.w = 1.0
        broadcaster.sendTransform(transform)
        rate.sleep()


if __name__ == "__main__":
    try:
        send()
    except rospy.ROSInterruptException:
        pass
