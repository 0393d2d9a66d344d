"""A page with sliders and buttons for a node, as in joint_state_publisher_gui and rqt_robot_steering.

The page uses the same server and access checks as the rqt pages. The node defines what the sliders do.
"""
