#!/usr/bin/python
"""Publish the voltage of the battery, which falls slowly."""
import rospy
from std_msgs.msg import Float64

rospy.init_node("battery")
publisher = rospy.Publisher("voltage", Float64, queue_size=10)
voltage = 12.6
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    publisher.publish(voltage)
    voltage = max(11.0, voltage - 0.001)
    rate.sleep()
