"""Package that contains `rosgraph.impl.graph`, which rqt_graph imports."""
