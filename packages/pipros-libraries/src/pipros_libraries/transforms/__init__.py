"""Coordinate frames and the transforms between them: the frame tree over time, and pose arithmetic.

The facades `tf`, `tf2_py`, `tf2_ros`, … are built on this package. Only `listener.py` uses topics.
"""
