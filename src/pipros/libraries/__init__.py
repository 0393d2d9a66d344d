"""The logic of the ROS libraries that build on rospy."""
