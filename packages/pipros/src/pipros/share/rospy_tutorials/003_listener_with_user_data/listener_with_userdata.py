#!/usr/bin/env python3
"""Logs the texts that arrive on `chatter`, with a value that the callback gets as its second argument."""

from std_msgs.msg import String

import rospy


def hear(message: String, name: str) -> None:
    rospy.loginfo("%s heard [%s]", name, message.data)


if __name__ == "__main__":
    rospy.init_node("listener_with_userdata", anonymous=True)
    rospy.Subscriber("chatter", String, hear, "The first callback")
    rospy.Subscriber("chatter", String, hear, callback_args="The second callback")
    rospy.spin()
