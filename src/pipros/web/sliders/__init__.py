"""A page of sliders and buttons for a node: those of joint_state_publisher_gui and rqt_robot_steering.

The server and the checks are those of the rqt pages. What the sliders do is up to the node.
"""
