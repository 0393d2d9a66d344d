#!/usr/bin/env python3
"""Asks the action server `fibonacci` for the first twenty numbers after the seeds."""

import sys

from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal, FibonacciResult

import actionlib
import rospy


def ask() -> FibonacciResult | None:
    """Return the numbers; None if the node was shut down first."""
    client = actionlib.SimpleActionClient("fibonacci", FibonacciAction)
    client.wait_for_server()
    client.send_goal(FibonacciGoal(order=20))
    client.wait_for_result()
    return client.get_result()


if __name__ == "__main__":
    rospy.init_node("fibonacci_client_py")
    result = ask()
    if result is None:
        sys.exit("program interrupted before completion")
    print("Result:", ", ".join(map(str, result.sequence)))
