"""The language of CMake, as far as packages without compiled code use it. Nothing of catkin is known here."""
