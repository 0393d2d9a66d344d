"""The gateway between ROS 1 and ROS 2."""
