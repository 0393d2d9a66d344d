"""Robots steered by hand: keys of a terminal and joysticks, and the velocity commands that they mean.

`key_bindings.py`, `joystick.py` and `joy_commands.py` are pure; the modules named `*_node.py` are programs.
"""
