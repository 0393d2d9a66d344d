"""Drop-in replacement for the parts of catkin's Python API that ROS code imports."""
