"""The gateway between ROS 1 and ROS 2, ROS 2 bags, and the conversion of messages."""
