"""Package of `rosgraph.impl.graph`, which rqt_graph imports."""
