"""Start a second node in one process by setting the names with which packages reset rospy.

Without the argument `revived`, the shutdown flag of the first node is not reset.
"""

import sys

from examination import begin, examine
from std_msgs.msg import String

import rospy
import rospy.client
import rospy.core


def kind_of_error(function):
    try:
        return function()
    except Exception as error:
        return type(error).__name__


def flags():
    core = rospy.core
    examine("flags", lambda: (core._shutdown_flag, core._in_shutdown, core._client_ready))
    examine("is_shutdown", lambda: (rospy.is_shutdown(), core.is_shutdown_requested()))
    examine("name", rospy.get_name)
    arguments = rospy.client._init_node_args
    examine("arguments", lambda: arguments and (arguments[0], *arguments[2:]))
    examine("uri", lambda: (core._uri or "").split(":")[0])


def main():
    begin("before")
    flags()
    rospy.init_node("first", disable_signals=True)
    publisher = rospy.Publisher("early", String, queue_size=1)
    begin("first")
    flags()
    examine("other name", lambda: kind_of_error(lambda: rospy.init_node("second", disable_signals=True)))
    rospy.signal_shutdown("for the second")
    begin("ended")
    flags()
    examine("publish", lambda: publisher.publish("x"))
    rospy.client._init_node_args = None
    if "revived" in sys.argv:
        rospy.core._shutdown_flag = rospy.core._in_shutdown = False
        rospy.init_node("second", disable_signals=True)
        begin("second")
        flags()
        examine("publish of the first", lambda: publisher.publish("x"))
        rospy.Publisher("late", String, queue_size=1)
        state = rospy.get_master().getSystemState()[2]
        examine("topics", lambda: [entry for entry in state[0] if "late" in entry[0] or "early" in entry[0]])
        rospy.signal_shutdown("done")
        examine("is_shutdown", rospy.is_shutdown)
    else:
        examine("init_node", lambda: kind_of_error(lambda: rospy.init_node("first", disable_signals=True)))
    rospy.core._shutdown_flag = True
    examine("is_shutdown", rospy.is_shutdown)


main()
