"""What the commands of CMake and catkin mean for a package without compiled code."""
