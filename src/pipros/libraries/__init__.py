"""The logic of the ROS libraries above rospy. It uses neither nodes nor sockets."""
