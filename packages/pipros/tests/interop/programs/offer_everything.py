"""A node that offers a latched topic, an echo, a service, an action and a parameter under its name."""

from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

import actionlib
import rospy
from actionlib.msg import TestAction, TestResult

rospy.init_node("offers")
name = rospy.get_name()
rospy.set_param("~parameter", "of " + name)
latched = rospy.Publisher("~latched", String, queue_size=1, latch=True)
latched.publish("latched by " + name)
echoed = rospy.Publisher("~echoed", String, queue_size=10)
rospy.Subscriber("~echo", String, echoed.publish)
rospy.Service("~trigger", Trigger, lambda _: TriggerResponse(True, "triggered at " + name))
server = actionlib.SimpleActionServer(
    "~act", TestAction, lambda goal: server.set_succeeded(TestResult(goal.goal + 1)), auto_start=False
)
server.start()
print("offers everything", flush=True)
rospy.spin()
