"""Conversion of serialized messages between ROS 1 and CDR, the encoding of ROS 2."""
