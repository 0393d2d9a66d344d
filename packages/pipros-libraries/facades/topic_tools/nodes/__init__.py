"""Executables of the topic_tools package."""
