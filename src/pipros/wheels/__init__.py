"""Wheels of ROS packages: building, installing and publishing them with pip or uv."""
