"""Shortest paths over a map of costs: navfn. Start with `plan.py`; topics are in `navfn_node.py`."""

from pipros.navigation.extras import missing_extra

try:
    import numpy  # noqa: F401
except ImportError as error:
    raise missing_extra(error) from None
