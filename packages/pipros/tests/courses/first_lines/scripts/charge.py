#!/usr/bin/python3
"""Convert the voltage of the battery to its charge in percent."""
import rospy
from std_msgs.msg import Float64


def convert(message):
    publisher.publish(100.0 * (message.data - 11.0) / 1.6)


rospy.init_node("charge")
publisher = rospy.Publisher("charge", Float64, queue_size=10)
rospy.Subscriber("voltage", Float64, convert)
rospy.spin()
