#!/usr/bin/python3
"""Pass the requested speed on, unless there is an obstacle or the brake is on."""
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

stops = {"obstacle": False, "brake_state": False}


def remember(message, name):
    stops[name] = message.data


def pass_on(wanted):
    publisher.publish(Twist() if any(stops.values()) else wanted)


rospy.init_node("speed")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
for topic in stops:
    rospy.Subscriber(topic, Bool, remember, callback_args=topic)
rospy.Subscriber("wanted", Twist, pass_on)
rospy.spin()
