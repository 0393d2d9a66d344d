"""SIGINT and SIGTERM end an action server with a running `execute_cb`, and its shutdown hooks run."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
from actionlib_msgs.msg import GoalID

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

ENDS_WITHIN_S = 30.0
"""Half a second is promised; this test looks for waits of a hundred seconds."""

SERVER = """
import sys, time
import actionlib, rospy
from actionlib.msg import TestAction

def execute(goal):
    print('working', flush=True)
    {work}

rospy.init_node('server')
rospy.on_shutdown(lambda: print('the hook ran', flush=True))
server = actionlib.SimpleActionServer('go', TestAction, execute, auto_start=False)
server.start()
print('ready', flush=True)
{main}
"""
BLOCKS = "time.sleep(100)"
NOTICES = """while not rospy.is_shutdown():
        time.sleep(0.01)
    print('the robot is parked', flush=True)"""


def start_server(processes: Processes, tmp_path: Path, master: Master, work: str, main: str) -> Process:
    script = tmp_path / "server.py"
    script.write_text(SERVER.format(work=work, main=main))
    server = processes.start(sys.executable, script, environment={"ROS_MASTER_URI": master.uri})
    server.wait_for("ready")
    return server


def send_goal(node: Node) -> None:
    goal_class = load_message_class("actionlib/TestActionGoal")
    publisher = node.advertise("/go/goal", goal_class)
    wait_until(lambda: publisher.connection_count > 0)
    publisher.publish(goal_class(goal_id=GoalID(id="first")))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_server_whose_callback_blocks(
    processes: Processes, tmp_path: Path, master: Master, number: signal.Signals
) -> None:
    server = start_server(processes, tmp_path, master, BLOCKS, "rospy.spin()")
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(number)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the hook ran" in server.output


def test_a_callback_that_notices_the_shutdown_finishes_its_work(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    patient = "actionlib.simple_action_server._GRACE_S = 60.0\nrospy.spin()"  # for a busy machine
    server = start_server(processes, tmp_path, master, NOTICES, patient)
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(signal.SIGINT)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the robot is parked" in server.output


def test_a_server_without_spin_serves_until_a_signal_as_in_noetic(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    server = start_server(processes, tmp_path, master, BLOCKS, "")
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(signal.SIGINT)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the hook ran" in server.output
