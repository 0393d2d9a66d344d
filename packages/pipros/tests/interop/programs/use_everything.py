"""Use all that the nodes named on the command line offer (see offer_everything.py)."""

import sys
import threading
import time
from xmlrpc.client import ServerProxy

from std_msgs.msg import String
from std_srvs.srv import Trigger

import actionlib
import rosgraph
import rospy
from actionlib.msg import TestAction, TestGoal

SECONDS = 60.0

rospy.init_node("uses", anonymous=True)
for name in rospy.myargv()[1:]:
    assert rospy.wait_for_message(name + "/latched", String, SECONDS).data == "latched by " + name
    came = threading.Event()
    subscriber = rospy.Subscriber(name + "/echoed", String, lambda message, came=came: came.set())
    publisher = rospy.Publisher(name + "/echo", String, queue_size=10)
    for _ in range(int(SECONDS / 0.1)):
        publisher.publish("hello")
        if came.wait(0.1):
            break
    else:
        sys.exit("nothing came back from " + name)
    rospy.wait_for_service(name + "/trigger", SECONDS)
    assert rospy.ServiceProxy(name + "/trigger", Trigger)().message == "triggered at " + name
    assert rospy.get_param(name + "/parameter") == "of " + name
    client = actionlib.SimpleActionClient(name + "/act", TestAction)
    assert client.wait_for_server(rospy.Duration(SECONDS))
    if name == "/open":  # genuine rospy answers a new link before it publishes to it, and loses a result
        server, link = ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(name)), name + "/act/result"
        while not any((each[1], each[4]) == (rospy.get_name(), link) for each in server.getBusInfo("")[2]):
            time.sleep(0.05)
    client.send_goal_and_wait(TestGoal(41), rospy.Duration(SECONDS))
    assert client.get_result().result == 42
    print("used " + name, flush=True)
