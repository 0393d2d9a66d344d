#!/usr/bin/python
"""Publish the distance to the next wall."""
import rospy
from std_msgs.msg import Float64

rospy.init_node("range_finder")
publisher = rospy.Publisher("range", Float64, queue_size=10)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    publisher.publish(rospy.get_param("~distance", 2.0))
    rate.sleep()
