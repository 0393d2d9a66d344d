"""A page of sliders and buttons for a node, as in joint_state_publisher_gui and rqt_robot_steering.

The server and the checks are those of the rqt pages. The node defines the effect of the sliders.
"""
