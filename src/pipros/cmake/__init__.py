"""Interpreter for the subset of CMake that packages without compiled code use."""
