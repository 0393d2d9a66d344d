"""Shortest paths over a map of costs: navfn. Start with `plan.py`; topics are in `navfn_node.py`."""
