#!/usr/bin/env python3
"""Logs who sent each text on `chatter`, and the additional field of the connection."""

from std_msgs.msg import String

import rospy


def hear(message: String) -> None:
    header = message._connection_header
    sender, cookies = header["callerid"], header.get("cookies", "no cookies")
    rospy.loginfo("I heard [%s] from [%s] with [%s]", message.data, sender, cookies)


if __name__ == "__main__":
    rospy.init_node("listener_connection_header", anonymous=True)
    rospy.Subscriber("chatter", String, hear)
    rospy.spin()
