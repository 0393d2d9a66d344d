"""Gateway between ROS 1 and ROS 2, support for ROS 2 bags, and message conversion."""
