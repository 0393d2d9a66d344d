"""Send goals to both servers of serve_goals.py, and print their outcomes."""

import threading

from actionlib_msgs.msg import GoalStatus

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal

rospy.init_node("client")
client = actionlib.SimpleActionClient("simple", TestAction)
print(client.wait_for_server(rospy.Duration(60)))
forever = rospy.Duration(60)
print(
    client.send_goal_and_wait(TestGoal(5), forever), client.get_result().result, client.get_goal_status_text()
)

events, done = [], threading.Event()


def on_done(status, result):
    events.append(("done", GoalStatus.to_string(status), result.result))
    done.set()


client.send_goal(TestGoal(7), on_done)
done.wait(60)
print(events)
fed = []


def send_and_wait_until_active():
    fed.clear()
    client.send_goal(TestGoal(100), feedback_cb=fed.append)
    while not (client.get_state() == GoalStatus.ACTIVE and fed) and not rospy.is_shutdown():
        rospy.sleep(0.01)


send_and_wait_until_active()
print(fed[0].feedback, client.wait_for_result(rospy.Duration(0.05)))
client.cancel_goal()
print(
    client.wait_for_result(forever),
    client.get_state(),
    client.get_result().result,
    client.get_goal_status_text(),
)
# long enough that no server gets the cancel request before the goal, which would be recalled
print(client.send_goal_and_wait(TestGoal(100), rospy.Duration(2), forever))

send_and_wait_until_active()
print(
    client.send_goal_and_wait(TestGoal(8), forever), client.get_result().result
)  # which preempts the previous goal
print(client.send_goal_and_wait(TestGoal(200), forever), client.get_goal_status_text())
print(client.send_goal_and_wait(TestGoal(300), forever))

full = actionlib.ActionClient("full", TestAction)
print(full.wait_for_server(rospy.Duration(60)))
for number in (-1, 1):
    states = []
    handle = full.send_goal(
        TestGoal(number),
        lambda h, seen=states: seen.append(actionlib.CommState.to_string(h.get_comm_state())),
    )
    while states[-1:] != ["DONE"] and not rospy.is_shutdown():
        rospy.sleep(0.01)
    print(
        states[-2:],
        actionlib.TerminalState.to_string(handle.get_terminal_state()),
        handle.get_result().result,
    )
    print(handle.get_goal_status_text())
send_and_wait_until_active()
client.cancel_all_goals()
print(client.wait_for_result(forever), client.get_state())
