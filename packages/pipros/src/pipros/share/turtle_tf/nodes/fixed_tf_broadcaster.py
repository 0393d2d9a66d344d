#!/usr/bin/env python3
"""Broadcasts the frame `carrot1`, two metres to the left of turtle1."""

import rospy
import tf


def send() -> None:
    rospy.init_node("fixed_tf_broadcaster")
    broadcaster = tf.TransformBroadcaster()
    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        x, y = 0.0, 2.0
        broadcaster.sendTransform((x, y, 0.0), (0.0, 0.0, 0.0, 1.0), rospy.Time.now(), "carrot1", "turtle1")
        rate.sleep()


if __name__ == "__main__":
    try:
        send()
    except rospy.ROSInterruptException:
        pass
