"""The part of ROS 2's package index that xacro 2 uses for `$(find …)`, based on the package path."""
