#!/usr/bin/python3
"""Convert ticks of the encoder to metres."""
import rospy
from std_msgs.msg import Float64, Int32

rospy.init_node("odometer")
publisher = rospy.Publisher("distance", Float64, queue_size=10)
rospy.Subscriber("ticks", Int32, lambda message: publisher.publish(message.data / 2000.0))
rospy.spin()
