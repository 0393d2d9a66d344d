"""A robot of a fleet: it runs on genuine rospy, and prints `ready`."""

import sys

from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, SetBoolResponse
from tf2_msgs.msg import TFMessage

import actionlib
import rospy
from actionlib.msg import TestAction, TestResult

name = sys.argv[1]
rospy.init_node("robot")


def switch(request):
    if not request.data:
        raise rospy.ServiceException(name + " is broken")
    return SetBoolResponse(True, name)


def execute(goal):
    rospy.sleep(0.3)  # genuine clients miss status updates that arrive before send_goal returns
    server.set_succeeded(TestResult(goal.goal + 1))


server = actionlib.SimpleActionServer("do", TestAction, execute, auto_start=False)
server.start()
echo = rospy.Publisher("echo", String, queue_size=10)
rospy.Subscriber("cmd", String, lambda message: echo.publish(name + " got " + message.data))
rospy.Service("lamp", SetBool, switch)
latched = rospy.Publisher("map", String, queue_size=1, latch=True)
latched.publish("map of " + name)
legal = rospy.Publisher("/aZ_09/_x__1/9", String, queue_size=10)
mismatched = rospy.Publisher("number", String, queue_size=10)
frame = TransformStamped(child_frame_id="laser")
frame.header.frame_id = "base"
static = rospy.Publisher("tf_static", TFMessage, queue_size=1, latch=True)
static.publish([frame])
rospy.set_param("~speed", 1.5)
chatter = rospy.Publisher("chatter", Int32, queue_size=10)
print("ready", flush=True)
rate = rospy.Rate(20)
number = 0
while not rospy.is_shutdown():
    chatter.publish(number)
    legal.publish("legal")
    mismatched.publish("no number")
    number += 1
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
