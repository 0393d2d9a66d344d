"""Manual control of robots: velocity commands from the keyboard, a joystick, or one of several sources.

`key_bindings.py`, `joystick.py`, `joy_commands.py` and `velocity_mux.py` perform no I/O; the modules
`*_node.py` are nodes.
"""
