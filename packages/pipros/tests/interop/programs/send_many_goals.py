"""Send argv[2] goals to /fibonacci, one after another, and print how many succeeded.

The goal handles of `ActionClient` are polled. `SimpleActionClient` can wait for ever for a goal that ends
at once: it ignores transitions that another thread reports before `send_goal` has stored the handle.
"""

import sys
import time

from genuine_fibonacci import load_fibonacci

import actionlib
import rospy

Action, Goal = load_fibonacci(sys.argv[1])
rospy.init_node("client")
client = actionlib.ActionClient("/fibonacci", Action)
print("server", client.wait_for_server(rospy.Duration(60)), flush=True)
ended = 0
for order in range(int(sys.argv[2])):
    handle = client.send_goal(Goal(order))
    deadline = time.monotonic() + 10
    while handle.get_comm_state() != actionlib.CommState.DONE and time.monotonic() < deadline:
        time.sleep(0.001)
    ended += handle.get_goal_status() == actionlib.GoalStatus.SUCCEEDED
print("succeeded", ended, flush=True)
