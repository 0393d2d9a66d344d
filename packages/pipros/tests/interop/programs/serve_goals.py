"""A SimpleActionServer.

A goal below 100 succeeds with its number, 100 waits for its end, 200 raises, 300 sets no result.
"""

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestResult


def execute(goal):
    rospy.sleep(0.3)  # genuine clients miss status updates that arrive before send_goal returns
    if goal.goal == 200:
        raise ValueError("by the goal")
    if goal.goal == 300:
        return
    while goal.goal == 100 and not server.is_preempt_requested() and not rospy.is_shutdown():
        server.publish_feedback(TestFeedback(goal.goal + 1))
        rospy.sleep(0.01)
    if server.is_preempt_requested():
        server.set_preempted(TestResult(-1), "asked to end")
    else:
        server.set_succeeded(TestResult(goal.goal), "reached")


def reject(handle):
    if handle.get_goal().goal < 0:
        handle.set_rejected(TestResult(-2), "not below zero")
    else:
        handle.set_accepted()
        handle.set_aborted(TestResult(-3), "never")


rospy.init_node("server")
server = actionlib.SimpleActionServer("simple", TestAction, execute, False)
server.start()
full = actionlib.ActionServer("full", TestAction, reject, auto_start=False)
full.start()
rospy.spin()
