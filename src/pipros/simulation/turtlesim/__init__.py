"""Turtlesim: turtles that draw on a picture, as nodes, and the programs around it.

`picture`, `turtle` and `world` are pure; `turtlesim_node` and `turtle_page` connect them to ROS and to
browsers.
"""
