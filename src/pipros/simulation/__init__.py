"""Simulated robots for courses and exercises: turtlesim."""
