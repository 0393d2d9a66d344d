#!/usr/bin/env python3
"""Asks the action server `fibonacci` for the first twenty numbers after the seeds."""

import sys

from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal, FibonacciResult

import actionlib
import rospy


def ask() -> FibonacciResult:
    client = actionlib.SimpleActionClient("fibonacci", FibonacciAction)
    client.wait_for_server()
    client.send_goal(FibonacciGoal(order=20))
    client.wait_for_result()
    return client.get_result()


if __name__ == "__main__":
    try:
        rospy.init_node("fibonacci_client_py")
        print("Result:", ", ".join(str(number) for number in ask().sequence))
    except rospy.ROSInterruptException:
        print("program interrupted before completion", file=sys.stderr)
