"""The computation graph as rqt_graph draws it: who is there, and who is connected to whom.

The master tells the nodes and what they have registered; each node tells its connections
(`getBusInfo`). Topics stand among nodes by their name with a blank in front, so that a topic and a
node of the same name differ.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from threading import Lock
from typing import Any, ClassVar

from pipros.errors import PiprosError
from pipros.net.rpc import RpcClient
from pipros.wire.xmlrpc import Fault
from rosgraph.masterapi import Master, MasterException

_CALLER_ID = "/rosviz"
_ANSWER_S = 3.0

logger = logging.getLogger("rosgraph.graph")


def topic_node(topic: str) -> str:
    """The name of a topic among nodes."""
    return " " + topic


def node_topic(node: str) -> str:
    """The topic that `topic_node` made that name of."""
    return node[1:]


class BadNode:
    """A node that could not be asked.

    Attributes:
        type: DEAD when no connection to it is possible, WONKY when it answers something wrong.
        reason: the error.
    """

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: Any) -> None:  # noqa: A002  # the name in ROS
        self.name = name
        self.type = type
        self.reason = reason


class Edge:
    """From one node or topic to another.

    Attributes:
        key, rkey: by which an `EdgeList` keeps it: start or end with the label.
    """

    __slots__ = ("end", "key", "label", "rkey", "start")
    __hash__: ClassVar[None]  # type: ignore[assignment]  # equal edges may have different labels

    def __init__(self, start: str, end: str, label: str = "") -> None:
        self.start = start
        self.end = end
        self.label = label
        self.key = f"{start}|{label}"
        self.rkey = f"{end}|{label}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Edge) and (self.start, self.end) == (other.start, other.end)

    def __str__(self) -> str:
        return f"{self.start}->{self.end}"


def edge_args(start: str, dest: str, direction: str, label: str) -> list[tuple[str, str, str]]:
    """The arguments of the edges of a connection: `o`utbound, `i`nbound or `b`oth, seen from `start`."""
    edges = []
    if direction in ("o", "b"):
        edges.append((start, dest, label))
    if direction in ("i", "b"):
        edges.append((dest, start, label))
    return edges


class EdgeList:
    """A set of edges that finds them by their start and by their end."""

    def __init__(self) -> None:
        self.edges_by_start: dict[str, list[Edge]] = {}
        self.edges_by_end: dict[str, list[Edge]] = {}

    def __iter__(self) -> Iterator[Edge]:
        return iter([edge for edges in self.edges_by_start.values() for edge in edges])

    def has(self, edge: Edge) -> bool:
        return edge in self.edges_by_start.get(edge.key, ())

    __contains__ = has

    def add(self, edge: Edge) -> bool:
        """True when it was not there yet."""
        if edge in self:
            return False
        self.edges_by_start.setdefault(edge.key, []).append(edge)
        self.edges_by_end.setdefault(edge.rkey, []).append(edge)
        return True

    def add_edges(self, start: str, dest: str, direction: str, label: str = "") -> bool:
        """True when one of them was not there yet."""
        added = [self.add(Edge(*arguments)) for arguments in edge_args(start, dest, direction, label)]
        return any(added)

    def delete(self, edge: Edge) -> None:
        """Harmless when it is not there."""
        for edges, key in ((self.edges_by_start, edge.key), (self.edges_by_end, edge.rkey)):
            left = [other for other in edges.get(key, ()) if other != edge]
            if left:
                edges[key] = left
            else:
                edges.pop(key, None)

    def delete_all(self, node: str) -> None:
        """Deletes all edges that begin or end at a node."""
        for edge in self:
            if node in (edge.start, edge.end):
                self.delete(edge)


class Graph:
    """What was found out about the graph, as of the last `update`.

    Attributes:
        nn_nodes, nn_edges: nodes, and connections from node to node, labelled with the topic.
        nt_nodes, nt_edges, nt_all_edges: topics; connections between nodes and topics; all that the
            registrations say there could be.
        srvs: the names of the services.
        bad_nodes: name to `BadNode` of those that could not be asked.
    """

    def __init__(self, node_ns: str = "/", topic_ns: str = "/") -> None:
        """Of the graph in the namespaces. Nothing is asked yet."""
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
        self.master = Master(_CALLER_ID)
        self.master_stale = 5.0
        self.node_stale = 5.0
        self.last_master_refresh = 0.0
        self.last_node_refresh: dict[str, float] = {}

    def set_master_stale(self, stale_secs: float) -> None:
        """How old what the master said may be."""
        self.master_stale = stale_secs

    def set_node_stale(self, stale_secs: float) -> None:
        """How old what a node said may be."""
        self.node_stale = stale_secs

    def update(self) -> bool:
        """Asks the master and nodes, bad ones too, whose answers are stale. True when something changed."""
        changed = False
        if time.time() - self.last_master_refresh > self.master_stale:
            changed = self._ask_master()
        for node in sorted(self.nn_nodes):
            if time.time() - self.last_node_refresh.get(node, 0.0) > self.node_stale:
                changed |= self._ask_node(node)
        return changed

    def bad_update(self) -> bool:
        """Asks the bad nodes again. True when something changed."""
        with self.bad_nodes_lock:
            bad = sorted(self.bad_nodes)
        changed = [self._ask_node(node) for node in bad]
        return any(changed)

    def _ask_master(self) -> bool:
        self.last_master_refresh = time.time()
        try:
            publishers, subscribers, services = self.master.getSystemState()
        except (MasterException, OSError) as error:
            logger.error("cannot ask the master: %s", error)
            return False
        nodes: set[str] = set()
        topics: set[str] = set()
        edges = EdgeList()
        for table, direction in ((publishers, "o"), (subscribers, "i")):
            for topic, names in table:
                if not topic.startswith(self.topic_ns):
                    continue
                for name in names:
                    if name.startswith(self.node_ns):
                        nodes.add(name)
                        topics.add(topic_node(topic))
                        edges.add_edges(name, topic_node(topic), direction)
        for _, names in services:
            nodes.update(name for name in names if name.startswith(self.node_ns))
        found = {service for service, _ in services}
        changed = (nodes, topics, found) != (self.nn_nodes, self.nt_nodes, self.srvs)
        changed |= len(list(edges)) != len(list(self.nt_all_edges)) or any(
            edge not in self.nt_all_edges for edge in edges
        )
        for gone in self.nn_nodes - nodes:
            self._forget(gone)
        self.nn_nodes, self.nt_nodes, self.srvs, self.nt_all_edges = nodes, topics, found, edges
        return changed

    def _forget(self, node: str) -> None:
        self.nn_edges.delete_all(node)
        self.nt_edges.delete_all(node)
        self.last_node_refresh.pop(node, None)
        self.uri_node_map.pop(self.node_uri_map.pop(node, ""), None)
        with self.bad_nodes_lock:
            self.bad_nodes.pop(node, None)

    def _ask_node(self, node: str) -> bool:
        self.last_node_refresh[node] = time.time()
        try:
            connections = self._bus_info(node)
        except (MasterException, OSError, PiprosError, Fault, ValueError) as error:
            is_dead = isinstance(error, OSError)
            logger.warning("cannot ask node [%s] about its connections: %s", node, error)
            with self.bad_nodes_lock:
                self.bad_nodes[node] = BadNode(node, BadNode.DEAD if is_dead else BadNode.WONKY, error)
            return False
        with self.bad_nodes_lock:
            self.bad_nodes.pop(node, None)
        changed = False
        for _, peer, direction, _, topic, *is_connected in connections:
            if is_connected[:1] == [False] or not topic.startswith(self.topic_ns):
                continue
            name = self._name_of(peer)
            changed |= self.nt_edges.add_edges(node, topic_node(topic), direction)
            if name is not None and name.startswith(self.node_ns):
                changed |= self.nn_edges.add_edges(node, name, direction, topic)
                opposite = {"i": "o", "o": "i"}.get(direction, direction)
                changed |= self.nt_edges.add_edges(name, topic_node(topic), opposite)
        return changed

    def _bus_info(self, node: str) -> list[Any]:
        """What a node says. Raises what `_ask_node` expects; ValueError for an answer of the wrong form."""
        api = self._api_of(node)
        with RpcClient(api, timeout_s=_ANSWER_S) as client:
            answer = client.call("getBusInfo", _CALLER_ID)
        if not isinstance(answer, list) or len(answer) != 3 or answer[0] != 1:
            raise ValueError(f"getBusInfo of {node} answered {str(answer)[:200]}")
        if not all(isinstance(row, list) and len(row) >= 5 for row in answer[2]):
            raise ValueError(f"getBusInfo of {node} has rows of another form")
        return list(answer[2])

    def _api_of(self, node: str) -> str:
        api = str(self.master.lookupNode(node))
        self.node_uri_map[node] = api
        self.uri_node_map[api] = node
        return api

    def _name_of(self, peer: str) -> str | None:
        """The node that a connection leads to: nodes name it by its name or by its API."""
        if not peer.startswith(("http://", "rosrpc://")):
            return peer
        if peer not in self.uri_node_map:
            for node in self.nn_nodes - self.node_uri_map.keys():
                try:
                    self._api_of(node)
                except (MasterException, OSError) as error:
                    logger.debug("the master does not know %s any more: %s", node, error)
        return self.uri_node_map.get(peer) or self.uri_node_map.get(peer.rstrip("/") + "/")
