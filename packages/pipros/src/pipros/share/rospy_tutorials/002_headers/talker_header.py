#!/usr/bin/env python3
"""Publishes texts with a header on `chatter_header`, twice a second. rospy sets the sequence number."""

from rospy_tutorials.msg import HeaderString
from std_msgs.msg import Header

import rospy


def talk() -> None:
    publisher = rospy.Publisher("chatter_header", HeaderString, queue_size=10)
    rospy.init_node("talker_header", anonymous=True)
    rate = rospy.Rate(2)
    while not rospy.is_shutdown():
        text = f"hello world {rospy.get_time()}"
        rospy.loginfo(text)
        publisher.publish(HeaderString(Header(stamp=rospy.Time.now()), text))
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass
