"""Turtlesim, in which turtles draw a picture, and its companion programs.

`picture`, `turtle` and `world` are pure; `turtlesim_node` and `turtle_page` connect them to ROS and to
browsers.
"""
