"""Send argv[2] goals to /fibonacci, one after another, and print how many succeeded."""

import sys

from genuine_fibonacci import load_fibonacci

import actionlib
import rospy

Action, Goal = load_fibonacci(sys.argv[1])
rospy.init_node("client")
client = actionlib.SimpleActionClient("/fibonacci", Action)
print("server", client.wait_for_server(rospy.Duration(60)), flush=True)
ended = 0
for order in range(int(sys.argv[2])):
    client.send_goal(Goal(order))
    ended += client.wait_for_result(rospy.Duration(10)) and client.get_state() == 3
print("succeeded", ended, flush=True)
