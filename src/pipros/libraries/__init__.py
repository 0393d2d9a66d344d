"""The libraries of ROS above rospy, as pure cores: no node, no sockets."""
