"""The commands that build, install and index wheels, and rosdep."""
