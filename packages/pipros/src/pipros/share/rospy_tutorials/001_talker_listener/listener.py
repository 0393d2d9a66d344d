#!/usr/bin/env python3
"""Logs the texts that arrive on `chatter`."""

from std_msgs.msg import String

import rospy


def hear(message: String) -> None:
    rospy.loginfo(rospy.get_caller_id() + "I heard %s", message.data)


if __name__ == "__main__":
    rospy.init_node("listener", anonymous=True)  # so that several listeners can run
    rospy.Subscriber("chatter", String, hear)
    rospy.spin()
