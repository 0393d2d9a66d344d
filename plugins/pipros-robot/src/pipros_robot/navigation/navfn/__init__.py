"""Cheapest paths over a costmap, as in navfn. Start with `plan.py`; `navfn_node.py` uses topics."""
