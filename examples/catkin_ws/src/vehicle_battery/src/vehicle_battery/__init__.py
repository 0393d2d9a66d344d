"""The battery of a vehicle: where its state comes from, and when to warn.

`power_supply`, `simulated_pack` and `assessment` know nothing of ROS and are tested without it;
`driver` and `monitor` are the nodes.
"""
