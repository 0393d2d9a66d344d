"""The battery of a vehicle: where its state comes from, and when to warn.

`power_supply`, `simulated_pack` and `assessment` do not depend on a ROS system, and are tested without it;
`driver` and `monitor` are the nodes.
"""
