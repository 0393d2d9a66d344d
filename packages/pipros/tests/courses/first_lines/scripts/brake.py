#!/usr/bin/python3 -u
"""The service of the hand brake."""
import rospy
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, SetBoolResponse


def pull(request):
    publisher.publish(request.data)
    print("brake " + ("on" if request.data else "off"))
    return SetBoolResponse(success=True, message="")


rospy.init_node("brake")
publisher = rospy.Publisher("brake_state", Bool, queue_size=1, latch=True)
rospy.Service("brake", SetBool, pull)
rospy.spin()
