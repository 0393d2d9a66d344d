#!/usr/bin/env python3

from composiv_tryouts.msg import BatteryLevel
import rospy

def subsCallback(data):
    rospy.loginfo("Battery level of vehicle: %s", data.battery)

def subscribeMsg():
    rospy.init_node("listener_node")
    rospy.Subscriber("battery_topic", BatteryLevel, subsCallback)
    rospy.spin()

subscribeMsg()
