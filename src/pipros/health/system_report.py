"""A running system, as values: what the master knows, and what each node, publisher and service answered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pipros.graph.bus_info import BusConnection
from pipros.graph.system_state import SystemState


@dataclass(frozen=True, slots=True)
class Failure:
    """Why something could not be reached.

    Attributes:
        reason: the error of the operating system or of the peer.
        is_unknown_host: its host name cannot be resolved here.
        is_refused: its machine answers, but no process listens there.
    """

    reason: str
    is_unknown_host: bool = False
    is_refused: bool = False


@dataclass(frozen=True, slots=True)
class NodeReport:
    """What a registered node answered.

    Attributes:
        api: its XML-RPC address, as the master knows it.
        failure: why it did not answer; None when it did.
        master_uri: the master that it uses, as it says; empty when it does not say.
        connections: its connections.
        subscriptions: topic to the type that it subscribes to, as it says.
        publications: topic to the type that it publishes, as it says.
    """

    api: str
    failure: Failure | None = None
    master_uri: str = ""
    connections: tuple[BusConnection, ...] = ()
    subscriptions: Mapping[str, str] = field(default_factory=dict)
    publications: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PublisherReport:
    """What a publisher answered to a subscriber of its topic.

    Attributes:
        address: `host:port` of its data; empty when it did not say.
        failure: why no connection was established; None when one was.
        type, md5sum: of its messages, by its connection header.
        stamp_offset_s: how far the stamp of a message was ahead of the clock of this machine.
    """

    address: str = ""
    failure: Failure | None = None
    type: str = ""
    md5sum: str = ""
    stamp_offset_s: float | None = None


@dataclass(frozen=True, slots=True)
class ServiceReport:
    """What the server of a service answered.

    Attributes:
        node: the node that offers it.
        uri: its address.
        failure: why it did not answer; None when it did.
    """

    node: str
    uri: str
    failure: Failure | None = None


@dataclass(frozen=True, slots=True)
class SystemReport:
    """A running system.

    Attributes:
        master_uri: its master.
        state: all registrations.
        types: topic to type, as the master knows it.
        nodes: what each node answered.
        publishers: (topic, node) to what the publisher answered.
        services: what each service answered.
        installed: type to the md5 sum of its definition on this machine; None when it is not installed.
        is_time_simulated: the parameter `/use_sim_time`.
        clock_offset_s: how far the clock of the master's machine is ahead of this one's; None when unknown.
        reached_back: (topic, node) of the subscribers that connected to a publisher on this machine.
        tried_back: (topic, node) of those for which that was tried.
    """

    master_uri: str
    state: SystemState
    types: Mapping[str, str] = field(default_factory=dict)
    nodes: Mapping[str, NodeReport] = field(default_factory=dict)
    publishers: Mapping[tuple[str, str], PublisherReport] = field(default_factory=dict)
    services: Mapping[str, ServiceReport] = field(default_factory=dict)
    installed: Mapping[str, str | None] = field(default_factory=dict)
    is_time_simulated: bool = False
    clock_offset_s: float | None = None
    reached_back: frozenset[tuple[str, str]] = frozenset()
    tried_back: frozenset[tuple[str, str]] = frozenset()

    def nodes_at(self, peer: str) -> set[str]:
        """The nodes at the other end of a connection, which may be given by name or by address."""
        if "://" not in peer:
            return {peer}
        wanted = peer.rstrip("/")
        return {name for name, node in self.nodes.items() if node.api.rstrip("/") == wanted}

    def is_alive(self, node: str) -> bool:
        """Whether the node answered."""
        report = self.nodes.get(node)
        return report is not None and report.failure is None

    def sends(self, publisher: str, topic: str) -> set[str]:
        """The nodes to which a publisher says it sends a topic."""
        return self._peers(publisher, topic, "o")

    def receives(self, subscriber: str, topic: str) -> set[str]:
        """The nodes from which a subscriber says it receives a topic."""
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
        """Every (topic, publisher, subscriber) that should be connected and whose nodes both answer."""
        return [
            (topic, publisher, subscriber)
            for topic, publishers in sorted(self.state.publishers.items())
            for publisher in publishers
            for subscriber in self.state.subscribers.get(topic, ())
            if self.is_alive(publisher) and self.is_alive(subscriber)
        ]

    def is_connected(self, topic: str, publisher: str, subscriber: str) -> tuple[bool, bool]:
        """Whether the publisher, and the subscriber, say that they are connected."""
        return subscriber in self.sends(publisher, topic), publisher in self.receives(subscriber, topic)
