"""The part of ROS 2's package index that xacro 2 uses for `$(find …)`. It finds ROS 1 packages."""
