"""Simulators for courses and exercises: turtlesim, and robots with laser scanners."""
