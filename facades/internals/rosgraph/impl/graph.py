"""The computation graph for rqt_graph. Facade of `pipros.graph`."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from pipros.graph.edges import Edge, EdgeList, edge_args
from pipros.graph.live import CALLER_ID, BadNode, LiveGraph, logger, node_topic, topic_node
from rosgraph.masterapi import Master

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "logger", "node_topic", "topic_node"]

_star_names(__name__, "itertools logging random rosgraph xmlrpc.client:ServerProxy socket sys time traceback")


class Graph(LiveGraph):
    """The graph of the environment's master; see `pipros.graph.live.LiveGraph`."""

    def __init__(self, node_ns: str = "/", topic_ns: str = "/") -> None:
        """Set up the graph of these namespaces, without querying the master."""
        self.master = Master(CALLER_ID)
        super().__init__(self.master.client, node_ns, topic_ns)
