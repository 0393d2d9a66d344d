"""A robot for clients of rosbridge: topics, a service, an action, frames. Runs on rospy and pipros."""

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool

import actionlib
import rospy
import tf2_ros
from actionlib.msg import TestAction, TestFeedback, TestResult


def count(goal):
    """Send one feedback and the result of the action."""
    server.publish_feedback(TestFeedback(1))
    server.set_succeeded(TestResult(2 * goal.goal))


rospy.init_node("robot")
rospy.Service("/enable", SetBool, lambda request: (request.data, "from robot"))
echo = rospy.Publisher("/echo", String, queue_size=10)
latched = rospy.Publisher("/latched", String, queue_size=1, latch=True)
latched.publish("kept")
rospy.Subscriber("/cmd", String, lambda message: echo.publish(f"echo {message.data}"))
server = actionlib.SimpleActionServer("/count", TestAction, count, auto_start=False)
server.start()
frames = tf2_ros.StaticTransformBroadcaster()
turn = Transform(Vector3(1, 2, 3), Quaternion(0, 0, 0, 1))
frames.sendTransform(TransformStamped(Header(frame_id="world", stamp=rospy.Time.now()), "arm", turn))
rospy.spin()
