"""`move_base`: drives a robot to goals, with a global planner, a local planner and recovery behaviours.

`machine.py` decides what to do next, and performs no I/O. `move_base_node.py` connects it to maps, planners
and topics.
"""
