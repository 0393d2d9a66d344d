#!/usr/bin/env python3
"""A node of ROS 1 and ROS 2: it passes numbers from one rospy topic to rclpy and back to another."""

import threading

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Int32

import rospy
from pipros.ros1.std_msgs.msg import Int32 as Ros1Int32
from pipros_ros2 import to_ros1, to_ros2

rospy.init_node("half")
rclpy.init()
node = rclpy.create_node("half")
executor = SingleThreadedExecutor()
executor.add_node(node)
there = node.create_publisher(Int32, "/middle", 1000)
back = rospy.Publisher("/out", Ros1Int32, queue_size=1000)
node.create_subscription(Int32, "/middle", lambda message: back.publish(to_ros1(message)), 1000)
rospy.Subscriber("/in", Ros1Int32, lambda message: there.publish(to_ros2(message)), queue_size=1000)
threading.Thread(target=executor.spin, daemon=True).start()
rospy.spin()
executor.shutdown()
rclpy.shutdown()
