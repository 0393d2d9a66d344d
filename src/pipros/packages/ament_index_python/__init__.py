"""The part of ROS 2's package index that xacro 2 asks for `$(find …)`, answered from the package path."""
