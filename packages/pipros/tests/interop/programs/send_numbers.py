"""Publish 0, 1, 2, … without end, 100 per second, on /numbers. Arguments: the node's name, the type."""

import sys

import genpy.dynamic
import roslib.message
import rospy

NAME, KIND = sys.argv[1:]
rospy.init_node(NAME)
# A type without a package is not installed anywhere: subscribers can have its definition from this node only.
found = roslib.message.get_message_class(KIND) or genpy.dynamic.generate_dynamic(KIND, "int32 data\n")[KIND]
publisher = rospy.Publisher("/numbers", found, queue_size=100)
number, rate = 0, rospy.Rate(100)
while not rospy.is_shutdown():
    publisher.publish(number)
    number += 1
    rate.sleep()
