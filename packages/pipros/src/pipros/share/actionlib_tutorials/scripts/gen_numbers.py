#!/usr/bin/env python3
"""Publishes random numbers around 5 on `random_number`, for the averaging server."""

import random

from std_msgs.msg import Float32

import rospy


def generate() -> None:
    publisher = rospy.Publisher("random_number", Float32, queue_size=1)
    rospy.init_node("random_number_generator", log_level=rospy.INFO)
    rospy.loginfo("Generating random numbers")
    while not rospy.is_shutdown():
        publisher.publish(Float32(random.normalvariate(5, 1)))
        rospy.sleep(0.05)


if __name__ == "__main__":
    try:
        generate()
    except rospy.ROSInterruptException:
        pass
