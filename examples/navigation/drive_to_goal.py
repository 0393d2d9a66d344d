#!/usr/bin/env python3
"""Drive straight to each goal, and publish the path, in place of a planner. Walls are ignored."""

import math

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Path
import contextlib

NEAR_M = 0.1
FASTEST_MPS = 0.3


class Driver:
    def __init__(self):
        self.goal = None
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)
        self.plans = rospy.Publisher("plan", Path, queue_size=1, latch=True)
        self.commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("move_base_simple/goal", PoseStamped, self.accept)

    def accept(self, goal):
        x, y, _ = self.pose()
        start = PoseStamped(header=goal.header)
        start.pose.position.x, start.pose.position.y = x, y
        start.pose.orientation.w = 1.0
        self.plans.publish(Path(header=goal.header, poses=[start, goal]))
        self.goal = goal.pose.position

    def pose(self):
        """Return the robot's x, y and yaw on the map."""
        found = self.buffer.lookup_transform("map", "base_link", rospy.Time(0), rospy.Duration(5)).transform
        return found.translation.x, found.translation.y, 2 * math.atan2(found.rotation.z, found.rotation.w)

    def step(self):
        if self.goal is None:
            return
        x, y, yaw = self.pose()
        dx, dy = self.goal.x - x, self.goal.y - y
        command = Twist()
        if math.hypot(dx, dy) < NEAR_M:
            self.goal = None
        else:
            turn = (math.atan2(dy, dx) - yaw + math.pi) % (2 * math.pi) - math.pi
            command.angular.z = max(-1.0, min(1.0, 2 * turn))
            command.linear.x = FASTEST_MPS if abs(turn) < 0.3 else 0.0
        self.commands.publish(command)


def main():
    rospy.init_node("drive_to_goal")
    driver = Driver()
    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        driver.step()
        rate.sleep()


if __name__ == "__main__":
    with contextlib.suppress(rospy.ROSInterruptException):
        main()
