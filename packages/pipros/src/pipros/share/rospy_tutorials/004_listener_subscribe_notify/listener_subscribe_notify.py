#!/usr/bin/env python3
"""Greets each new subscriber of `chatter` by name, and says goodbye to the others when one leaves."""

from collections.abc import Callable

from std_msgs.msg import String

import rospy


class Greeter(rospy.SubscribeListener):
    """Called by the publisher, in its own threads."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        rospy.loginfo("a new subscriber of %s", topic_name)
        topic_publish(String("A subscriber has joined."))  # to all subscribers
        peer_publish(String("Welcome!"))  # only to the new one

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        rospy.loginfo("a subscriber of %s has left, %d remain", topic_name, num_peers)


if __name__ == "__main__":
    rospy.init_node("listener_subscribe_notify", anonymous=True)
    rospy.Publisher("chatter", String, Greeter(), queue_size=10)
    rospy.spin()
