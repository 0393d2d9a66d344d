"""Print the outcomes of functions of rospy and rostopic without a master."""

from examination import begin, examine

import rospy
import rostopic


def refused(function):
    try:
        return function()
    except ConnectionRefusedError:
        return "refused"


begin("no master")
for label, call in (
    ("get_param", lambda: rospy.get_param("/x")), ("get_param default", lambda: rospy.get_param("/x", 1)),
    ("set_param", lambda: rospy.set_param("/x", 1)), ("has_param", lambda: rospy.has_param("/x")),
    ("get_published_topics", lambda: rospy.get_published_topics()),
    ("getPid", lambda: rospy.get_master().getPid()), ("get_topic_list", lambda: rostopic.get_topic_list()),
):  # fmt: skip
    examine(label, lambda: refused(call))
