"""ROS 1's messages and services, even in an environment where ROS 2's have the public names.

In an environment without ROS 2, `from pipros.ros1.std_msgs.msg import String` imports the same class as
`from std_msgs.msg import String`. Every package with ROS 1 definitions has such modules.
plugins/pipros-ros2/docs/guides/ros2.md describes environments with both.
"""
