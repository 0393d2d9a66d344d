#!/usr/bin/python3
"""Wait until the robot has driven a little, pull the brake, and print a report."""
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

rospy.init_node("report")
charge = rospy.wait_for_message("charge", Float64).data
while rospy.wait_for_message("distance", Float64).data < 0.02:
    pass
rospy.wait_for_service("brake")
answer = rospy.ServiceProxy("brake", SetBool)(True)
while rospy.wait_for_message("cmd_vel", Twist).linear.x > 0:
    pass
print("charged: %s, driven, stopped: %s" % (90 < charge <= 100, answer.success))
