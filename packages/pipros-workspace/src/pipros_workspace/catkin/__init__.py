"""The CMake and catkin commands that packages without compiled code need."""
