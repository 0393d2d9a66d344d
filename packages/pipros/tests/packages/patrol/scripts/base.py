#!/usr/bin/env python3
"""A base that drives straight to its goals: an action server, and a broadcaster of its pose."""

import math

from geometry_msgs.msg import PoseStamped, TransformStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult

import actionlib
import rospy
import tf2_ros
from tf.transformations import quaternion_from_euler

STEP = 0.5


class Base:
    def __init__(self):
        self.x = self.y = self.heading = 0.0
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self.drive, auto_start=False)
        self.server.start()
        rospy.Timer(rospy.Duration(0.05), self.broadcast)

    def broadcast(self, _event):
        transform = TransformStamped()
        transform.header.stamp = rospy.Time.now()
        transform.header.frame_id = "map"
        transform.child_frame_id = "base_link"
        transform.transform.translation.x = self.x
        transform.transform.translation.y = self.y
        rotation = transform.transform.rotation
        rotation.x, rotation.y, rotation.z, rotation.w = quaternion_from_euler(0, 0, self.heading)
        self.broadcaster.sendTransform(transform)

    def drive(self, goal):
        place = goal.target_pose.pose.position
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            # Also before the first result, which a genuine client may miss before send_goal has returned.
            rate.sleep()
            if self.server.is_preempt_requested():
                self.server.set_preempted(text="stopped")
                return
            if place.x < 0:
                self.server.set_aborted(text="there is a wall")
                return
            left = math.hypot(place.x - self.x, place.y - self.y)
            if left < 1e-9:
                break
            self.heading = math.atan2(place.y - self.y, place.x - self.x)
            step = min(STEP, left)
            self.x += step * math.cos(self.heading)
            self.y += step * math.sin(self.heading)
            if left <= STEP:
                self.x, self.y = place.x, place.y
            feedback = MoveBaseFeedback(PoseStamped(header=goal.target_pose.header))
            feedback.base_position.pose.position.x = self.x
            feedback.base_position.pose.position.y = self.y
            self.server.publish_feedback(feedback)
        self.broadcast(None)
        self.server.set_succeeded(MoveBaseResult(), "there")


if __name__ == "__main__":
    rospy.init_node("base")
    Base()
    rospy.spin()
