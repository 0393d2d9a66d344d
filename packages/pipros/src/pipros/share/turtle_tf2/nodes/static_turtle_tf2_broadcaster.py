#!/usr/bin/env python3
"""Broadcasts one static transform from `world`, which the command line specifies."""

import sys
from math import cos, sin

from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros

rospy.init_node("my_static_tf2_broadcaster")
arguments = rospy.myargv(sys.argv)[1:]
if len(arguments) != 7:
    rospy.logerr(
        "Invalid number of parameters\n"
        "usage: static_turtle_tf2_broadcaster child_frame_name x y z roll pitch yaw"
    )
    sys.exit(255)
if arguments[0] == "world":
    rospy.logerr("Your static turtle name cannot be 'world'")
    sys.exit(255)
x, y, z, roll, pitch, yaw = map(float, arguments[1:])
static = TransformStamped()
static.header.stamp = rospy.Time.now()
static.header.frame_id, static.child_frame_id = "world", arguments[0]
place, turn = static.transform.translation, static.transform.rotation
place.x, place.y, place.z = x, y, z
cr, sr, cp, sp = cos(roll / 2), sin(roll / 2), cos(pitch / 2), sin(pitch / 2)
cy, sy = cos(yaw / 2), sin(yaw / 2)
turn.x, turn.y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
turn.z, turn.w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
broadcaster = tf2_ros.StaticTransformBroadcaster()
broadcaster.sendTransform(static)
rospy.loginfo("Spinning until killed publishing %s to world", arguments[0])
rospy.spin()
