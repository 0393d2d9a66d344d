"""The computation graph for rqt_graph. Facade of `pipros_tools.graph.live`."""

from __future__ import annotations

from collections.abc import Iterable
from threading import Lock
from typing import Any

from pipros_tools.graph.live import CALLER_ID, GraphLink, LiveGraph, logger
from pipros_tools.graph.live import vertex_of_topic as topic_node
from rosgraph.impl.edges import Edge, EdgeList, edge_args
from rosgraph.masterapi import Master

__all__ = ["BadNode", "Edge", "EdgeList", "Graph", "edge_args", "logger", "node_topic", "topic_node"]


def node_topic(node: str) -> str:
    """Return the topic that a vertex name represents."""
    return node[1:]


class BadNode:
    """A node that did not report its connections.

    Attributes:
        type: DEAD if the node cannot be reached, WONKY if its response is malformed.
        reason: the error.
    """

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: Any) -> None:  # noqa: A002  # the name in ROS
        self.name = name
        self.type = type
        self.reason = reason


def _of_live(attribute: str) -> property:
    return property(
        lambda self: getattr(self._live, attribute),
        lambda self, value: setattr(self._live, attribute, value),
    )


class Graph:
    """The graph of the master at ROS_MASTER_URI, as of the last `update`; see
    `pipros_tools.graph.live.LiveGraph`.

    Attributes:
        nn_nodes, nt_nodes, srvs: the node vertices, the topic vertices, and the names of the services.
        bad_nodes_lock: lock held while `bad_nodes` changes.
        master_stale, node_stale: maximum ages of reused responses from the master and from nodes, in seconds.
        last_master_refresh, last_node_refresh: times of the last query to the master and to each node.
        node_uri_map, uri_node_map: mappings from nodes to URIs and back, for the nodes looked up so far.
    """

    def __init__(self, node_ns: str = "/", topic_ns: str = "/") -> None:
        """Set up the graph for the given namespaces, without querying the master."""
        self.master = Master(CALLER_ID)
        self._live = LiveGraph(self.master.client, node_ns, topic_ns)
        self.node_ns = self._live.node_namespace
        self.topic_ns = self._live.topic_namespace
        self.bad_nodes_lock: Lock = self._live.silent_lock

    master_stale = _of_live("max_age_of_state_s")
    node_stale = _of_live("max_age_of_report_s")
    last_master_refresh = _of_live("master_asked_at")
    last_node_refresh = _of_live("asked_at")
    node_uri_map = _of_live("apis")
    uri_node_map = _of_live("nodes_by_api")
    nn_nodes = _of_live("nodes")
    nt_nodes = _of_live("topics")
    srvs = _of_live("services")

    @property
    def nn_edges(self) -> EdgeList:
        """The connections from node to node, labelled with the topic."""
        return _edges(self._live.links)

    @property
    def nt_edges(self) -> EdgeList:
        """The connections between nodes and topics, as reported by the nodes."""
        return _edges(self._live.topic_links)

    @property
    def nt_all_edges(self) -> EdgeList:
        """The connections between nodes and topics, according to the registrations."""
        return _edges(self._live.registered_links)

    @property
    def bad_nodes(self) -> dict[str, BadNode]:
        """The nodes that did not report their connections."""
        return {
            name: BadNode(name, BadNode.WONKY if report.is_reachable else BadNode.DEAD, report.reason)
            for name, report in self._live.silent.items()
        }

    def set_master_stale(self, stale_secs: float) -> None:
        """Set the maximum age of a reused response from the master, in seconds."""
        self.master_stale = stale_secs

    def set_node_stale(self, stale_secs: float) -> None:
        """Set the maximum age of a reused response from a node, in seconds."""
        self.node_stale = stale_secs

    def update(self) -> bool:
        """Query the master and all nodes, including bad nodes, unless their last responses are recent enough.

        Return True if anything changed.
        """
        return self._live.update()

    def bad_update(self) -> bool:
        """Query the bad nodes again. Return True if anything changed."""
        return self._live.query_silent_nodes()


def _edges(links: Iterable[GraphLink]) -> EdgeList:
    edges = EdgeList()
    for link in sorted(links):
        edges.add(Edge(*link))
    return edges
