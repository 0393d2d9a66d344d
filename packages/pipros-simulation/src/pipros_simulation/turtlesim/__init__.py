"""Turtlesim, in which turtles draw a picture, and its companion programs.

`picture`, `turtle` and `world` perform no I/O; `turtlesim_node` and `turtle_page` connect them to ROS and to
browsers.
"""
