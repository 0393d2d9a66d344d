#!/usr/bin/env python3
"""Read the laser."""

from sensor_msgs.msg import LaserScan

import rospy

rospy.init_node("viewer")
rospy.Subscriber("/scan", LaserScan, lambda scan: None)
rospy.spin()
