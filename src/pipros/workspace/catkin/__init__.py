"""The commands of CMake and catkin, as they apply to packages without compiled code."""
