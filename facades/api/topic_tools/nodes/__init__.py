"""Executables of the package topic_tools."""
