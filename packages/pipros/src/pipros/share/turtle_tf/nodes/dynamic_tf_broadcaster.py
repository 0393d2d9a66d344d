#!/usr/bin/env python3
"""Broadcasts the frame `carrot1`, which circles around turtle1 every two seconds."""

import math

import rospy
import tf


def send() -> None:
    rospy.init_node("dynamic_tf_broadcaster")
    broadcaster = tf.TransformBroadcaster()
    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        angle = math.pi * rospy.Time.now().to_sec()
        x, y = 2.0 * math.sin(angle), 2.0 * math.cos(angle)
        broadcaster.sendTransform((x, y, 0.0), (0.0, 0.0, 0.0, 1.0), rospy.Time.now(), "carrot1", "turtle1")
        rate.sleep()


if __name__ == "__main__":
    try:
        send()
    except rospy.ROSInterruptException:
        pass
