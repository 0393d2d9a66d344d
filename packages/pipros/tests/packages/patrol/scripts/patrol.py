#!/usr/bin/env python3
"""Drive to some places, and check the arrival with tf."""

import sys
import threading

from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PointStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

import actionlib
import rospy
import tf
import tf2_geometry_msgs  # noqa: F401 - registers the types that the buffer transforms
import tf2_ros

PLACES = [(2.0, 0.0), (2.0, 3.0), (-1.0, 0.0)]


def goal_at(x, y):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.header.stamp = rospy.Time.now()
    goal.target_pose.pose.position.x = x
    goal.target_pose.pose.position.y = y
    goal.target_pose.pose.orientation.w = 1.0
    return goal


def main():
    rospy.init_node("patrol")
    buffer = tf2_ros.Buffer()
    tf2_ros.TransformListener(buffer)
    old_listener = tf.TransformListener()
    client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
    if not client.wait_for_server(rospy.Duration(60)):
        return 1
    for x, y in PLACES:
        client.send_goal(goal_at(x, y))
        client.wait_for_result(rospy.Duration(60))
        state, now = client.get_state(), rospy.Time.now()
        print(f"({x}, {y}): {GoalStatus.to_string(state)} {client.get_goal_status_text()}")
        if state == GoalStatus.SUCCEEDED:
            found = buffer.lookup_transform("map", "base_link", now, rospy.Duration(60))
            translation = found.transform.translation
            old_listener.waitForTransform("map", "base_link", now, rospy.Duration(60))
            (old_x, old_y, _), _ = old_listener.lookupTransform("map", "base_link", now)
            nose = PointStamped()
            nose.header.frame_id, nose.header.stamp, nose.point.x = "base_link", now, 1.0
            point = buffer.transform(nose, "map", rospy.Duration(60)).point
            print(f"  at {translation.x:.2f} {translation.y:.2f}, {old_x:.2f} {old_y:.2f}", end="")
            print(f", nose at {point.x:.2f} {point.y:.2f}")
    moving = threading.Event()
    # A genuine client ignores a status that comes before send_goal has returned: active_cb may not be called.
    client.send_goal(goal_at(1000.0, 0.0), feedback_cb=lambda _: moving.set())
    # It takes a cancelled goal for lost if an older status, without the goal, arrives later.
    print(f"moved: {moving.wait(60)}")
    client.cancel_goal()
    client.wait_for_result(rospy.Duration(60))
    print(f"cancelled: {GoalStatus.to_string(client.get_state())} {client.get_goal_status_text()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
