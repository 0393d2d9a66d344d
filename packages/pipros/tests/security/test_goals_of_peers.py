"""Peers cannot make the goals of an action server grow without limit, nor its timer spin."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from actionlib_msgs.msg import GoalID, GoalStatus

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.nodes import wait_until_connected
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

SERVER = """
import actionlib, rospy
from actionlib.msg import TestAction

rospy.init_node('server')
timer = rospy.Timer
def observed(period, *arguments, **options):
    print('period', period.to_nsec(), flush=True)
    return timer(period, *arguments, **options)
rospy.Timer = observed
server = actionlib.ActionServer('go', TestAction, lambda goal: goal.set_accepted(), auto_start=False)
server.start()
print('ready', flush=True)
rospy.spin()
"""
ActionGoal: Any = load_message_class("actionlib/TestActionGoal")
ActionResult: Any = load_message_class("actionlib/TestActionResult")
GoalStatusArray: Any = load_message_class("actionlib_msgs/GoalStatusArray")


def start_server(processes: Processes, tmp_path: Path, master: Master) -> Process:
    script = tmp_path / "server.py"
    script.write_text(SERVER)
    server = processes.start(
        sys.executable, script, environment={"ROS_MASTER_URI": master.uri, "PIPROS_LIMITS": "goals=5"}
    )
    server.wait_for("ready")
    return server


def test_goals_and_cancels_in_advance_are_limited(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    server = start_server(processes, tmp_path, master)
    results: dict[str, int] = {}
    statuses: list[Any] = []

    def keep(result: Any) -> None:
        results[result.status.goal_id.id] = result.status.status

    with Node("peer", environment=Environment(master_uri=master.uri)) as node:
        result = node.subscribe("/go/result", ActionResult, keep)
        node.subscribe("/go/status", GoalStatusArray, lambda array: statuses.append(array.status_list))
        cancels = node.advertise("/go/cancel", GoalID, queue_size=100)
        goals = node.advertise("/go/goal", ActionGoal, queue_size=100)
        wait_until_connected(cancels)
        wait_until_connected(goals)
        wait_until_connected(result)
        for number in range(20):
            cancels.publish(GoalID(id=f"unknown {number}"))
        wait_until(
            lambda: any(len(each) == 5 for each in statuses), 60, lambda: f"{statuses} {server.output}"
        )
        for number in range(20):
            goals.publish(ActionGoal(goal_id=GoalID(id=f"goal {number}")))
        wait_until(lambda: len(results) == 15, 60, lambda: f"{results} {server.output}")
        wait_until(
            lambda: [each.goal_id.id for each in statuses[-1]] == [f"goal {number}" for number in range(5)],
            60,
        )

    assert results == {f"goal {number}": GoalStatus.REJECTED for number in range(5, 20)}
    assert max(map(len, statuses)) == 5
    assert server.output.count("the limit is 5 (goals in PIPROS_LIMITS)") == 1


def test_a_status_frequency_beyond_reason_is_limited(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    with Node("peer", environment=Environment(master_uri=master.uri)) as node:
        node.master.set_param("/actionlib_status_frequency", 1e12)
        server = start_server(processes, tmp_path, master)
    server.wait_for("period 1000000$")
