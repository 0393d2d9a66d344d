"""actionlib: goals with the same or no ID, and cancellations that arrive before their goals, were lost."""

from __future__ import annotations

import sys
from pathlib import Path

from pipros.master.master import Master
from tests.support.processes import Processes

SCRIPT = """
import time

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from actionlib_tutorials.msg import FibonacciAction, FibonacciActionGoal

rospy.init_node("node")
calls, statuses = [], []

def on_goal(goal):
    goal.set_accepted()
    calls.append(goal.get_goal_id().id)

server = actionlib.ActionServer("fib", FibonacciAction, on_goal, auto_start=False)
server.start()
goals = rospy.Publisher("fib/goal", FibonacciActionGoal, queue_size=10)
cancels = rospy.Publisher("fib/cancel", GoalID, queue_size=10)
rospy.Subscriber("fib/status", GoalStatusArray, lambda message: statuses.append(message.status_list))

def wait(condition):
    end = time.monotonic() + 30
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)

wait(lambda: goals.get_num_connections() and cancels.get_num_connections())
cancels.publish(GoalID(id="early"))
wait(lambda: any(len(each) == 1 for each in statuses))
for name in ("early", "one", "one", "", "", "last"):
    goals.publish(FibonacciActionGoal(goal_id=GoalID(rospy.Time.now(), name)))
wait(lambda: "last" in calls)
server.publish_status()
wait(lambda: statuses and len(statuses[-1]) == 5)
print([name if name in ("one", "last") else name.startswith("/node-") for name in calls])
print(len(set(calls)), [each.status for each in statuses[-1]])
"""


def test_each_goal_is_accepted_once_and_an_early_cancellation_counts(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    (script := tmp_path / "node.py").write_text(SCRIPT)
    node = processes.run(sys.executable, str(script), environment={"ROS_MASTER_URI": master.uri})
    assert node.stdout == ["['one', True, True, 'last']", "4 [8, 1, 1, 1, 1]"], node.output
