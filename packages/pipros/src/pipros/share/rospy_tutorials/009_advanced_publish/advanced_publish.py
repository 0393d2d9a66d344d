#!/usr/bin/env python3
"""Publishes in all ways that `publish` knows: a message, its fields in order, and its fields by name."""

from itertools import count

from std_msgs.msg import ColorRGBA, Float64, String

import rospy


def publish() -> None:
    rospy.init_node("advanced_publish", anonymous=True)
    texts = rospy.Publisher("chatter", String, queue_size=10)
    numbers = rospy.Publisher("number", Float64, queue_size=10)
    colors = rospy.Publisher("color", ColorRGBA, queue_size=10)
    rate = rospy.Rate(2)
    for number in count():
        if rospy.is_shutdown():
            return
        texts.publish(String("as a message"))
        texts.publish("as its only field")
        numbers.publish(float(number))
        colors.publish(1.0, 0.5, 0.0, 1.0)  # all fields, in order
        colors.publish(r=0.2, a=1.0)  # other fields keep their defaults
        rate.sleep()


if __name__ == "__main__":
    try:
        publish()
    except rospy.ROSInterruptException:
        pass
