#!/usr/bin/env python3
"""Provides an action that computes the Fibonacci sequence, one number per second."""

from actionlib_tutorials.msg import FibonacciAction, FibonacciFeedback, FibonacciGoal, FibonacciResult

import actionlib
import rospy


class FibonacciServer:
    def __init__(self, name: str) -> None:
        self._name = name
        self._server = actionlib.SimpleActionServer(
            name, FibonacciAction, execute_cb=self._execute, auto_start=False
        )
        self._server.start()

    def _execute(self, goal: FibonacciGoal) -> None:
        rate = rospy.Rate(1)
        sequence = [0, 1]
        rospy.loginfo(
            "%s: Executing, creating fibonacci sequence of order %i with seeds %i, %i",
            self._name,
            goal.order,
            *sequence,
        )
        for _ in range(1, goal.order):
            if self._server.is_preempt_requested():
                rospy.loginfo("%s: Preempted", self._name)
                self._server.set_preempted()
                return
            sequence.append(sequence[-1] + sequence[-2])
            self._server.publish_feedback(FibonacciFeedback(sequence))
            rate.sleep()
        rospy.loginfo("%s: Succeeded", self._name)
        self._server.set_succeeded(FibonacciResult(sequence))


if __name__ == "__main__":
    rospy.init_node("fibonacci")
    FibonacciServer(rospy.get_name())
    rospy.spin()
