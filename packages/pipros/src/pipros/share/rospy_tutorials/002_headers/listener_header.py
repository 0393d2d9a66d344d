#!/usr/bin/env python3
"""Logs the headers and texts that arrive on `chatter_header`."""

from rospy_tutorials.msg import HeaderString

import rospy


def hear(message: HeaderString) -> None:
    header = message.header
    rospy.loginfo("I heard [%s], number %d, sent at %.3f", message.data, header.seq, header.stamp.to_sec())


if __name__ == "__main__":
    rospy.init_node("listener_header", anonymous=True)
    rospy.Subscriber("chatter_header", HeaderString, hear)
    rospy.spin()
