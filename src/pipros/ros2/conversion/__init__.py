"""Conversion of serialized messages between ROS 1 and ROS 2's encoding, CDR."""
