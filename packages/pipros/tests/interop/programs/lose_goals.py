"""Remove goals from the status list of an action server, and print what its client then reports."""

import time

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal


def wait_for(condition):
    deadline = time.monotonic() + 30
    while not condition():
        if time.monotonic() > deadline:
            raise SystemExit("timeout")
        time.sleep(0.01)


def delete():
    del server.status_list[0]


def clear():
    server.status_list.clear()


def replace():
    server.status_list = [each for each in server.status_list if each is None]


rospy.init_node("both")
server = actionlib.ActionServer("act", TestAction, lambda handle: handle.set_accepted(), auto_start=False)
print(server.status_list)
server.start()
client = actionlib.ActionClient("act", TestAction)
print(client.wait_for_server(rospy.Duration(60)))
kept = server.status_list
for lose in (delete, clear, replace):
    handle = client.send_goal(TestGoal(1))
    wait_for(lambda handle=handle: handle.get_comm_state() == actionlib.CommState.ACTIVE)
    with server.lock:
        print([type(each).__name__ for each in server.status_list], kept is server.status_list)
        lose()
    wait_for(lambda handle=handle: handle.get_comm_state() == actionlib.CommState.DONE)
    print(lose.__name__, actionlib.TerminalState.to_string(handle.get_terminal_state()))
print(server.status_list)
