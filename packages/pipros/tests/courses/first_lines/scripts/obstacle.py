#! /usr/bin/python3
"""Say whether a wall is near."""
import rospy
from std_msgs.msg import Bool, Float64


class Obstacle:
    def __init__(self):
        self.near_m = rospy.get_param("~near", 0.5)
        self.publisher = rospy.Publisher("obstacle", Bool, queue_size=1, latch=True)
        rospy.Subscriber("range", Float64, self.measured)

    def measured(self, message):
        self.publisher.publish(message.data < self.near_m)


if __name__ == "__main__":
    rospy.init_node("obstacle")
    Obstacle()
    rospy.spin()
