"""`move_base`: drives a robot to goals, with a global planner, a local planner and recovery behaviours.

`machine.py` decides what to do next (pure); `move_base_node.py` connects it with maps, planners and topics.
"""
