"""The language of CMake, as far as packages without compiled code use it. Nothing in it depends on catkin."""
