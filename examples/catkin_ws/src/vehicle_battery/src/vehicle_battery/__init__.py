"""Read or simulate the battery of a vehicle, and decide when to warn.

`power_supply`, `simulated_pack` and `assessment` do not depend on a ROS system, and are tested without it;
`driver` and `monitor` are the nodes.
"""
