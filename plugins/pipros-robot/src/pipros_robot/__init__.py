"""Perception and navigation: the programs of many ROS packages, in Python."""
