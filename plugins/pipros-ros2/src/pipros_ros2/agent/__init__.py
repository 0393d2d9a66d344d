"""The engine that reaches ROS 2 through the rclpy of another Python."""
