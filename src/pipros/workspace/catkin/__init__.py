"""The CMake and catkin commands, as they apply to packages without compiled code."""
