"""The live graph of nodes, topics and their actual connections.

The master reports the nodes and their registrations; each node reports its connections (`getBusInfo`).
Vertices are named after nodes and topics; names of topics have a leading space, which distinguishes them from
nodes with the same name.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.net.rpc_client import RpcClient
from pipros_tools.graph.bus_info import BusConnection, read_row, rows_of
from pipros_tools.graph.system_state import SystemState

if TYPE_CHECKING:
    from pipros.net.master_client import MasterClient

CALLER_ID = "/rosviz"
ANSWER_DEADLINE_S = 3.0
"""Timeout for a node's response."""

logger = logging.getLogger("rosgraph.graph")


def ask_bus_info(api: str) -> Any:
    """Call `getBusInfo` on the node at this URI. Raises the same errors as `RpcClient.call`."""
    with RpcClient(api, timeout_s=ANSWER_DEADLINE_S) as client:
        return client.call("getBusInfo", CALLER_ID)


class GraphLink(NamedTuple):
    """A connection from one vertex to another."""

    start: str
    end: str
    topic: str = ""


@dataclass(frozen=True, slots=True)
class NoReport:
    """The reason why a node did not report its connections.

    Attributes:
        is_reachable: False if the connection to the node failed; True for any other reason, such as an
            invalid report.
    """

    is_reachable: bool
    reason: Exception


def vertex_of_topic(topic: str) -> str:
    """Return the vertex name for a topic."""
    return " " + topic


def links_of(start: str, end: str, direction: str, topic: str = "") -> set[GraphLink]:
    """Return the links for a connection.

    `direction`, as seen from `start`, is `o` (outbound), `i` (inbound) or `b` (both).
    """
    links = set()
    if direction in ("o", "b"):
        links.add(GraphLink(start, end, topic))
    if direction in ("i", "b"):
        links.add(GraphLink(end, start, topic))
    return links


class LiveGraph:
    """The graph as of the last `update`.

    Attributes:
        nodes, topics: the vertices.
        services: names of the services.
        links: connections from node to node.
        topic_links, registered_links: connections between nodes and topics, as reported by the nodes and as
            implied by the registrations, respectively.
        silent: the nodes that did not report their connections, with the reasons.
        apis, nodes_by_api: the API addresses that have been looked up, by node, and the nodes by address.
        master_asked_at, asked_at: when the master and each node were last queried, on the graph's clock.
        max_age_of_state_s, max_age_of_report_s: how long responses from the master and from nodes are reused.
    """

    def __init__(
        self,
        master: MasterClient,
        node_namespace: str = "/",
        topic_namespace: str = "/",
        *,
        max_age_s: float = 5.0,
        ask: Callable[[str], Any] = ask_bus_info,
        now_s: Callable[[], float] = time.time,
    ) -> None:
        """Create the graph for the given namespaces. Nothing is queried before `update`.

        Args:
            max_age_s: how long responses are reused.
            ask: function that calls `getBusInfo` on the node at a URI.
            now_s: the clock that measures the age of responses.
        """
        self.node_namespace = node_namespace or "/"
        self.topic_namespace = topic_namespace or "/"
        self.nodes: set[str] = set()
        self.topics: set[str] = set()
        self.services: set[str] = set()
        self.links: set[GraphLink] = set()
        self.topic_links: set[GraphLink] = set()
        self.registered_links: set[GraphLink] = set()
        self.silent: dict[str, NoReport] = {}
        self.silent_lock = Lock()
        self.max_age_of_state_s = self.max_age_of_report_s = max_age_s
        self.asked_at: dict[str, float] = {}
        self.master_asked_at = 0.0
        self.apis: dict[str, str] = {}
        self.nodes_by_api: dict[str, str] = {}
        self._master = master
        self._query = ask
        self._now_s = now_s

    def update(self) -> bool:
        """Query the master, and then nodes, if their last responses are too old.

        Errors are logged. Return True if anything changed.
        """
        changed = False
        if self._now_s() - self.master_asked_at > self.max_age_of_state_s:
            changed = self._query_master()
        for node in sorted(self.nodes):
            if self._now_s() - self.asked_at.get(node, 0.0) > self.max_age_of_report_s:
                changed |= self._query_node(node)
        return changed

    def query_silent_nodes(self) -> bool:
        """Query again the nodes that did not report their connections. Return True if anything changed."""
        with self.silent_lock:
            silent = sorted(self.silent)
        changed = [self._query_node(node) for node in silent]
        return any(changed)

    def _query_master(self) -> bool:
        self.master_asked_at = self._now_s()
        try:
            state = SystemState.from_state(self._master.get_system_state())
        except PiprosError as error:
            logger.error("cannot query the master: %s", error)
            return False
        before = self.nodes, self.topics, self.services, self.registered_links
        links = set(self._links_in(state))
        providers = {name for names in state.services.values() for name in names if self._shows(name)}
        nodes = providers | {end for link in links for end in link[:2] if not end.startswith(" ")}
        for gone in self.nodes - nodes:
            self._forget(gone)
        self.nodes = nodes
        self.topics = {end for link in links for end in link[:2] if end.startswith(" ")}
        self.services = set(state.services)
        self.registered_links = links
        return before != (self.nodes, self.topics, self.services, self.registered_links)

    def _shows(self, node: str) -> bool:
        return node.startswith(self.node_namespace)

    def _links_in(self, state: SystemState) -> Iterator[GraphLink]:
        for registrations, direction in ((state.publishers, "o"), (state.subscribers, "i")):
            for topic, names in registrations.items():
                if topic.startswith(self.topic_namespace):
                    for name in filter(self._shows, names):
                        yield from links_of(name, vertex_of_topic(topic), direction)

    def _forget(self, node: str) -> None:
        self.links = {link for link in self.links if node not in link[:2]}
        self.topic_links = {link for link in self.topic_links if node not in link[:2]}
        self.asked_at.pop(node, None)
        self.nodes_by_api.pop(self.apis.pop(node, ""), None)
        with self.silent_lock:
            self.silent.pop(node, None)

    def _query_node(self, node: str) -> bool:
        self.asked_at[node] = self._now_s()
        try:
            connections = self._bus_info(node)
        except (PiprosError, ValueError) as error:
            logger.warning("cannot query the connections of node [%s]: %s", node, error)
            with self.silent_lock:
                self.silent[node] = NoReport(not isinstance(error, OSError), error)
            return False
        with self.silent_lock:
            self.silent.pop(node, None)
        before = len(self.links), len(self.topic_links)
        for connection in connections:
            if connection.is_established and connection.topic.startswith(self.topic_namespace):
                self._add(node, connection)
        return before != (len(self.links), len(self.topic_links))

    def _add(self, node: str, connection: BusConnection) -> None:
        direction, topic = connection.direction, connection.topic
        name = self._name_of(connection.peer)
        self.topic_links |= links_of(node, vertex_of_topic(topic), direction)
        if name is not None and self._shows(name):
            self.links |= links_of(node, name, direction, topic)
            opposite = {"i": "o", "o": "i"}.get(direction, direction)
            self.topic_links |= links_of(name, vertex_of_topic(topic), opposite)

    def _bus_info(self, node: str) -> list[BusConnection]:
        """Return the connections of a node.

        Raises:
            PiprosError: the node cannot be reached.
            ValueError: the response or a row is malformed.
        """
        connections = []
        for row in rows_of(self._query(self._api_of(node)), f"getBusInfo of {node}"):
            connection = read_row(row)
            if connection is None:
                rule = "rows of at least 5 values, with strings for peer, direction and topic"
                raise ValueError(f"getBusInfo of {node} must return {rule}, got {printable(row)}")
            connections.append(connection)
        return connections

    def _api_of(self, node: str) -> str:
        api = self._master.lookup_node(node)
        self.apis[node] = api
        self.nodes_by_api[api] = node
        return api

    def _name_of(self, peer: str) -> str | None:
        """Return the name of the node with this name or URI, or None if the URI is unknown."""
        if not peer.startswith(("http://", "rosrpc://")):
            return peer
        if peer not in self.nodes_by_api:
            for node in self.nodes - self.apis.keys():
                try:
                    self._api_of(node)
                except PiprosError as error:
                    logger.debug("cannot look up node [%s]: %s", node, error)
        return self.nodes_by_api.get(peer) or self.nodes_by_api.get(peer.rstrip("/") + "/")
