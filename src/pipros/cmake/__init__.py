"""The CMake language, as far as packages without compiled code use it. Independent of catkin."""
