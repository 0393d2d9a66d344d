"""The part of the CMake language that packages without compiled code use."""
