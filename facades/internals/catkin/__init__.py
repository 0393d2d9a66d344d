"""The names of catkin that ROS code imports; a facade of `pipros.workspace` and `pipros.testing`."""
