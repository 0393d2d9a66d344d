"""Executables of the tf2_ros package."""
