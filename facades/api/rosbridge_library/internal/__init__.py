"""Conversions, classes by name, and exceptions of rosbridge_library."""
