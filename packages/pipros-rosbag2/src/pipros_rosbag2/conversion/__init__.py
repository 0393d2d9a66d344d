"""Conversion of serialized messages between ROS 1's encoding and CDR, the encoding of ROS 2."""
