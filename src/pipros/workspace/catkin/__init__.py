"""The CMake and catkin commands, as far as packages without compiled code need them."""
