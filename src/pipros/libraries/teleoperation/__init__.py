"""Manual control of robots: velocity commands from the keyboard or a joystick.

`key_bindings.py`, `joystick.py` and `joy_commands.py` perform no I/O; the modules `*_node.py` are programs.
"""
