"""Frames and the transforms between them: the tree of frames over time, and the mathematics of poses.

The facades `tf`, `tf2_py`, `tf2_ros`, … are built on it. Nothing here has a socket or a clock.
"""
