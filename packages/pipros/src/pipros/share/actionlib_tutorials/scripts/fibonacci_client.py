#!/usr/bin/env python3
"""Requests the Fibonacci sequence of order 20 from the action server `fibonacci`."""

import sys

from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal, FibonacciResult

import actionlib
import rospy


def ask() -> FibonacciResult | None:
    """Return the result; None if the node was shut down first."""
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
