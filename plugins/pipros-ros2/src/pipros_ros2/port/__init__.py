"""Porting of rospy nodes to rclpy."""
