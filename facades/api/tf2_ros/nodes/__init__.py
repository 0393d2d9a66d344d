"""Executables of the package tf2_ros."""
