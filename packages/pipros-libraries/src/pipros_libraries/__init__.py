"""Logic of ROS libraries, such as actionlib, tf2 and diagnostics."""
