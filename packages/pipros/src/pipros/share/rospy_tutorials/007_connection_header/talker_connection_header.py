#!/usr/bin/env python3
"""Publishes on `chatter`, with an additional field in the header of each connection."""

from std_msgs.msg import String

import rospy


def talk() -> None:
    rospy.init_node("talker_connection_header", anonymous=True)
    fields = {"cookies": "oreo, " + rospy.get_name()}
    publisher = rospy.Publisher("chatter", String, headers=fields, queue_size=10)
    rate = rospy.Rate(2)
    while not rospy.is_shutdown():
        publisher.publish(f"hello world {rospy.get_time()}")
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
