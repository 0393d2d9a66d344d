"""Programs with a loop, an action server or an updater go on after simulated time has moved back."""

from __future__ import annotations

import sys
from typing import Any

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Clock: Any = load_message_class("rosgraph_msgs/Clock")
Goal: Any = load_message_class("actionlib/TestActionGoal")
PROGRAMS = {
    "/tf": ("tf", "static_transform_publisher", *["0", "0", "0", "0", "0", "0", "a", "b", "100"]),
    "/diagnostics_agg": ("diagnostic_aggregator", "aggregator_node"),
}
SCRIPT = """
import actionlib, diagnostic_updater, rospy
from actionlib.msg import TestAction
rospy.init_node("served")
server = actionlib.SimpleActionServer("act", TestAction, lambda goal: server.set_succeeded(), False)
server.start()
updater = diagnostic_updater.Updater()
rospy.Timer(rospy.Duration(0.1), lambda _: updater.update())
rospy.spin()
"""


def test_programs_go_on(ros: RosSystem) -> None:
    ros.serve_master()
    received: dict[str, int] = {}
    ended: list[str] = []
    with Node("probe", environment=Environment(master_uri=ros.master_uri)) as node:
        node.master.set_param("/use_sim_time", True)
        clock, goals = node.advertise("/clock", Clock), node.advertise("/act/goal", Goal)

        def count(topic: str) -> None:
            received[topic] = received.get(topic, 0) + 1

        kinds = ("tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "diagnostic_msgs/DiagnosticArray")
        topics = (*PROGRAMS, "/diagnostics")
        for topic, kind in zip(topics, kinds, strict=True):
            node.subscribe(topic, load_message_class(kind), lambda _, topic=topic: count(topic))
        result: Any = load_message_class("actionlib/TestActionResult")
        node.subscribe("/act/result", result, lambda each: ended.append(each.status.goal_id.id))
        started = [ros.pipros.start_node(*each) for each in PROGRAMS.values()]
        started.append(ros.pipros.start(sys.executable, "-c", SCRIPT))
        for begin_s in (1000, 100):
            received.clear()
            now_s = float(begin_s)

            def is_done(name: str) -> bool:
                """Let time pass, and send a goal until it has ended."""
                nonlocal now_s
                now_s += 0.1
                clock.publish(Clock(Time.from_sec(now_s)))
                made = Goal()
                made.goal_id.id, made.goal_id.stamp = name, Time.from_sec(now_s)
                goals.publish(made)
                return name in ended and all(received.get(topic, 0) > 1 for topic in topics)

            wait_until(
                lambda name=f"goal {begin_s}": is_done(name),
                60,
                lambda: f"{received} {ended} {[each.output for each in started]}",
            )
