#!/usr/bin/env python3
"""An errand as a state machine: requests a path, drives while it is clear, and finally gives up."""

import sys

from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from state_machines import (
    Concurrence,
    IntrospectionServer,
    MonitorState,
    ServiceState,
    SimpleActionState,
    State,
    StateMachine,
)
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

import rospy


class Count(State):
    def __init__(self, limit):
        State.__init__(self, ["again", "enough"], input_keys=["tries"], output_keys=["tries"])
        self.limit = limit

    def execute(self, userdata):
        userdata.tries += 1
        return "enough" if userdata.tries >= self.limit else "again"


def goal_to(userdata):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x = userdata.place
    goal.target_pose.pose.orientation.w = 1.0
    return goal


def keep_place(userdata, response):
    userdata.place = float(response.message)
    return "succeeded" if response.success else "aborted"


def keep_status(userdata, status, _result):
    userdata.ended = GoalStatus.to_string(status)


def main():
    rospy.init_node("errand")
    machine = StateMachine(["done", "failed", "preempted"])
    machine.userdata.tries = 0
    with machine:
        StateMachine.add(
            "ASK",
            ServiceState("where", Trigger, response_cb=keep_place, output_keys=["place"]),
            {"succeeded": "DRIVE", "aborted": "COUNT"},
            {"place": "goal"},
        )
        drive = Concurrence(
            ["there", "blocked"],
            "blocked",
            {"there": {"MOVE": "succeeded"}},
            lambda ended: True,
            input_keys=["place"],
            output_keys=["ended"],
        )
        StateMachine.add("DRIVE", drive, {"there": "ASK", "blocked": "COUNT"}, {"place": "goal"})
        with drive:
            move = SimpleActionState(
                "move_base",
                MoveBaseAction,
                goal_to,
                keep_status,
                input_keys=["place"],
                output_keys=["ended"],
            )
            Concurrence.add("MOVE", move)
            Concurrence.add("WATCH", MonitorState("clear", Bool, lambda _, message: message.data))
        StateMachine.add("COUNT", Count(2), {"again": "ASK", "enough": "failed"})
    seen = []
    watcher = rospy.Subscriber(
        "errand/container_status",
        DiagnosticStatus,
        lambda status: seen.append(f"{status.name}: {status.message}"),
    )
    server = IntrospectionServer("errand", machine, "/ERRAND")
    server.start()
    while server.publisher.get_num_connections() == 0 and not rospy.is_shutdown():
        rospy.rostime.wallsleep(0.01)

    outcome = machine.execute()

    while f"/ERRAND: {outcome}" not in seen and not rospy.is_shutdown():
        rospy.rostime.wallsleep(0.01)
    server.stop()
    watcher.unregister()
    print("\n".join(seen))
    print(f"{outcome} after {machine.userdata.tries} tries, drive {machine.userdata.ended}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
