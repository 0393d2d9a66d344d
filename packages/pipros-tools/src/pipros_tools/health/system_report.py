"""Snapshot of a running system: registrations, and the responses of nodes, publishers and services."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pipros_tools.graph.bus_info import BusConnection
from pipros_tools.graph.system_state import SystemState
from pipros_tools.health.plugin_check import PluginReply


@dataclass(frozen=True, slots=True)
class Failure:
    """The reason a peer could not be reached.

    Attributes:
        reason: the error from the operating system or the peer.
        is_unknown_host: whether the host name cannot be resolved here.
        is_refused: whether the machine refused the connection, because no process listens on the port.
    """

    reason: str
    is_unknown_host: bool = False
    is_refused: bool = False


@dataclass(frozen=True, slots=True)
class NodeReport:
    """A registered node's responses.

    Attributes:
        api: the node's XML-RPC address according to the master.
        failure: why the node did not respond; None if it did.
        master_uri: the master that the node reports using; empty if it reports none.
        connections: the node's connections.
        subscriptions: maps topics to subscribed types, as reported by the node.
        publications: maps topics to published types, as reported by the node.
    """

    api: str
    failure: Failure | None = None
    master_uri: str = ""
    connections: tuple[BusConnection, ...] = ()
    subscriptions: Mapping[str, str] = field(default_factory=dict)
    publications: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PublisherReport:
    """A publisher's responses to a subscriber.

    Attributes:
        address: the `host:port` of its TCPROS server; empty if it did not respond.
        failure: why no connection was established; None if a connection was established.
        type, md5sum: the type and md5 sum of its messages, from its connection header.
        stamp_offset_s: a message's stamp minus this machine's clock, in seconds; None if unknown.
    """

    address: str = ""
    failure: Failure | None = None
    type: str = ""
    md5sum: str = ""
    stamp_offset_s: float | None = None


@dataclass(frozen=True, slots=True)
class ServiceReport:
    """Result of probing one service server.

    Attributes:
        node: the node that provides the service.
        uri: the server's address.
        failure: why the server did not respond; None if it responded.
    """

    node: str
    uri: str
    failure: Failure | None = None


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A running system.

    Attributes:
        master_uri: the URI of the master.
        state: all registrations.
        types: maps topics to types, according to the master.
        nodes: maps nodes to their responses.
        publishers: maps (topic, node) to the publisher's responses.
        services: maps services to the results of probing their servers.
        installed: maps types to the md5 sum of the definition on this machine; None if the type is not
            installed.
        is_time_simulated: whether the parameter `/use_sim_time` is true.
        clock_offset_s: the clock of the master's machine minus this machine's; None if unknown.
        plugin_replies: maps nodes of plugins to their replies; see `PluginCheck`.
        nodelets: a line for each nodelet in Python: its name, its plugin, and its inputs.
        reached_back: the (topic, node) pairs of the subscribers that connected to a publisher on this
            machine.
        tried_back: the (topic, node) pairs of the subscribers for which this was tested.
    """

    master_uri: str
    state: SystemState
    types: Mapping[str, str] = field(default_factory=dict)
    nodes: Mapping[str, NodeReport] = field(default_factory=dict)
    publishers: Mapping[tuple[str, str], PublisherReport] = field(default_factory=dict)
    services: Mapping[str, ServiceReport] = field(default_factory=dict)
    installed: Mapping[str, str | None] = field(default_factory=dict)
    is_time_simulated: bool = False
    plugin_replies: Mapping[str, PluginReply] = field(default_factory=dict)
    nodelets: tuple[str, ...] = ()
    clock_offset_s: float | None = None
    reached_back: frozenset[tuple[str, str]] = frozenset()
    tried_back: frozenset[tuple[str, str]] = frozenset()

    def nodes_at(self, peer: str) -> set[str]:
        """Return the nodes at the other end of a connection. `peer` is a node's name or address."""
        if "://" not in peer:
            return {peer}
        wanted = peer.rstrip("/")
        return {name for name, node in self.nodes.items() if node.api.rstrip("/") == wanted}

    def is_alive(self, node: str) -> bool:
        """Return whether the node responded."""
        report = self.nodes.get(node)
        return report is not None and report.failure is None

    def sends(self, publisher: str, topic: str) -> set[str]:
        """Return the nodes to which a publisher reports sending a topic."""
        return self._peers(publisher, topic, "o")

    def receives(self, subscriber: str, topic: str) -> set[str]:
        """Return the nodes from which a subscriber reports receiving a topic."""
        return self._peers(subscriber, topic, "i")

    def _peers(self, node: str, topic: str, direction: str) -> set[str]:
        report = self.nodes.get(node)
        if report is None:
            return set()
        return {
            name
            for connection in report.connections
            if connection.topic == topic and connection.direction in (direction, "b")
            for name in self.nodes_at(connection.peer)
        }

    def pairs(self) -> list[tuple[str, str, str]]:
        """Return each (topic, publisher, subscriber) that should be connected and whose nodes both answer."""
        return [
            (topic, publisher, subscriber)
            for topic, publishers in sorted(self.state.publishers.items())
            for publisher in publishers
            for subscriber in self.state.subscribers.get(topic, ())
            if self.is_alive(publisher) and self.is_alive(subscriber)
        ]

    def is_connected(self, topic: str, publisher: str, subscriber: str) -> tuple[bool, bool]:
        """Return whether the publisher reports the connection, and whether the subscriber does."""
        return subscriber in self.sends(publisher, topic), publisher in self.receives(subscriber, topic)
