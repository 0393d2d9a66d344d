"""Shared by all tests: waiting for conditions, free ports, processes, terminals, genuine ROS."""
