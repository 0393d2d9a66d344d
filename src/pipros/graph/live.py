"""The live graph of nodes, topics and actual connections.

The master knows the nodes and their registrations; each node knows its connections (`getBusInfo`). The name
of a topic gets a leading space to distinguish it from a node of the same name. Classes and attributes are
named as in `rosgraph.impl.graph`, which rqt_graph uses.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from threading import Lock
from typing import Any, Protocol

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.graph.bus_info import BusConnection, read_row, rows_of
from pipros.graph.edges import EdgeList
from pipros.graph.system_state import SystemState
from pipros.net.rpc_client import RpcClient

CALLER_ID = "/rosviz"
ANSWER_DEADLINE_S = 3.0
"""Timeout for the answer of a node."""

logger = logging.getLogger("rosgraph.graph")


class GraphMaster(Protocol):
    """Calls to the master, implemented by `pipros.net.master_client.MasterClient`."""

    def get_system_state(self) -> Sequence[Sequence[Sequence[Any]]]: ...
    def lookup_node(self, node: str) -> str: ...


def ask_bus_info(api: str) -> Any:
    """Call `getBusInfo` of the node at this URI. Raise the same errors as `RpcClient.call`."""
    with RpcClient(api, timeout_s=ANSWER_DEADLINE_S) as client:
        return client.call("getBusInfo", CALLER_ID)


def topic_node(topic: str) -> str:
    """Return the vertex name of a topic."""
    return " " + topic


def node_topic(node: str) -> str:
    """Return the topic of a vertex name."""
    return node[1:]


class BadNode:
    """A node that did not report its connections.

    Attributes:
        type: DEAD if it cannot be reached, WONKY if its answer is malformed.
        reason: the error.
    """

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: Any) -> None:  # noqa: A002  # the name in ROS
        self.name = name
        self.type = type
        self.reason = reason


class LiveGraph:
    """The graph as of the last `update`.

    Attributes:
        nn_nodes, nn_edges: nodes, and connections from node to node, labelled with the topic.
        nt_nodes, nt_edges, nt_all_edges: topics; connections between nodes and topics; all connections that
            the registrations allow.
        srvs: names of the services.
        bad_nodes: `BadNode` by name of the nodes that did not report their connections.
    """

    def __init__(
        self,
        master: GraphMaster,
        node_ns: str = "/",
        topic_ns: str = "/",
        *,
        ask: Callable[[str], Any] = ask_bus_info,
        now_s: Callable[[], float] = time.time,
    ) -> None:
        """Create the graph of these namespaces without querying anything yet.

        Args:
            ask: function that calls `getBusInfo` of the node at a URI.
            now_s: clock for the age of answers.
        """
        self.node_ns = node_ns or "/"
        self.topic_ns = topic_ns or "/"
        self.nn_nodes: set[str] = set()
        self.nt_nodes: set[str] = set()
        self.nn_edges = EdgeList()
        self.nt_edges = EdgeList()
        self.nt_all_edges = EdgeList()
        self.srvs: set[str] = set()
        self.bad_nodes: dict[str, BadNode] = {}
        self.bad_nodes_lock = Lock()
        self.node_uri_map: dict[str, str] = {}
        self.uri_node_map: dict[str, str] = {}
        self.master_stale = 5.0
        self.node_stale = 5.0
        self.last_master_refresh = 0.0
        self.last_node_refresh: dict[str, float] = {}
        self._master = master
        self._query = ask
        self._now_s = now_s

    def set_master_stale(self, stale_secs: float) -> None:
        """Set for how many seconds an answer of the master is used."""
        self.master_stale = stale_secs

    def set_node_stale(self, stale_secs: float) -> None:
        """Set for how many seconds an answer of a node is used."""
        self.node_stale = stale_secs

    def update(self) -> bool:
        """Query the master and the nodes whose answers are stale, bad ones too. Return True on any change."""
        changed = False
        if self._now_s() - self.last_master_refresh > self.master_stale:
            changed = self._query_master()
        for node in sorted(self.nn_nodes):
            if self._now_s() - self.last_node_refresh.get(node, 0.0) > self.node_stale:
                changed |= self._query_node(node)
        return changed

    def bad_update(self) -> bool:
        """Query the bad nodes again. Return True if anything changed."""
        with self.bad_nodes_lock:
            bad = sorted(self.bad_nodes)
        changed = [self._query_node(node) for node in bad]
        return any(changed)

    def _query_master(self) -> bool:
        self.last_master_refresh = self._now_s()
        try:
            state = SystemState.from_state(self._master.get_system_state())
        except PiprosError as error:
            logger.error("cannot query the master: %s", error)
            return False
        nodes: set[str] = set()
        topics: set[str] = set()
        edges = EdgeList()
        for registrations, direction in ((state.publishers, "o"), (state.subscribers, "i")):
            for topic, names in registrations.items():
                if not topic.startswith(self.topic_ns):
                    continue
                for name in names:
                    if name.startswith(self.node_ns):
                        nodes.add(name)
                        topics.add(topic_node(topic))
                        edges.add_edges(name, topic_node(topic), direction)
        for names in state.services.values():
            nodes.update(name for name in names if name.startswith(self.node_ns))
        services = set(state.services)
        changed = (nodes, topics, services) != (self.nn_nodes, self.nt_nodes, self.srvs)
        changed |= len(list(edges)) != len(list(self.nt_all_edges)) or any(
            edge not in self.nt_all_edges for edge in edges
        )
        for gone in self.nn_nodes - nodes:
            self._forget(gone)
        self.nn_nodes, self.nt_nodes, self.srvs, self.nt_all_edges = nodes, topics, services, edges
        return changed

    def _forget(self, node: str) -> None:
        self.nn_edges.delete_all(node)
        self.nt_edges.delete_all(node)
        self.last_node_refresh.pop(node, None)
        self.uri_node_map.pop(self.node_uri_map.pop(node, ""), None)
        with self.bad_nodes_lock:
            self.bad_nodes.pop(node, None)

    def _query_node(self, node: str) -> bool:
        self.last_node_refresh[node] = self._now_s()
        try:
            connections = self._bus_info(node)
        except (PiprosError, ValueError) as error:
            is_dead = isinstance(error, OSError)
            logger.warning("cannot query the connections of node [%s]: %s", node, error)
            with self.bad_nodes_lock:
                self.bad_nodes[node] = BadNode(node, BadNode.DEAD if is_dead else BadNode.WONKY, error)
            return False
        with self.bad_nodes_lock:
            self.bad_nodes.pop(node, None)
        changed = False
        for connection in connections:
            direction, topic = connection.direction, connection.topic
            if not connection.is_established or not topic.startswith(self.topic_ns):
                continue
            name = self._name_of(connection.peer)
            changed |= self.nt_edges.add_edges(node, topic_node(topic), direction)
            if name is not None and name.startswith(self.node_ns):
                changed |= self.nn_edges.add_edges(node, name, direction, topic)
                opposite = {"i": "o", "o": "i"}.get(direction, direction)
                changed |= self.nt_edges.add_edges(name, topic_node(topic), opposite)
        return changed

    def _bus_info(self, node: str) -> list[BusConnection]:
        """Return the connections of a node.

        Raises:
            PiprosError: the node cannot be reached.
            ValueError: the answer or a row is malformed.
        """
        connections = []
        for row in rows_of(self._query(self._api_of(node)), f"getBusInfo of {node}"):
            connection = read_row(row)
            if connection is None:
                raise ValueError(f"getBusInfo of {node} must return rows of 5 values, got {printable(row)}")
            connections.append(connection)
        return connections

    def _api_of(self, node: str) -> str:
        api = self._master.lookup_node(node)
        self.node_uri_map[node] = api
        self.uri_node_map[api] = node
        return api

    def _name_of(self, peer: str) -> str | None:
        """Return the node at the other end of a connection, given by name or URI."""
        if not peer.startswith(("http://", "rosrpc://")):
            return peer
        if peer not in self.uri_node_map:
            for node in self.nn_nodes - self.node_uri_map.keys():
                try:
                    self._api_of(node)
                except PiprosError as error:
                    logger.debug("the master no longer knows %s: %s", node, error)
        return self.uri_node_map.get(peer) or self.uri_node_map.get(peer.rstrip("/") + "/")
