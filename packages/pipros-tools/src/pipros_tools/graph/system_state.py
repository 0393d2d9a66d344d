"""A running system's registrations as one value: publishers, subscribers and services."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from pipros.basics.errors import PiprosError

if TYPE_CHECKING:
    from pipros.net.master_client import MasterClient

Registrations = Mapping[str, Sequence[str]]
"""The nodes for each topic or service. Both topics and nodes are in the order of registration."""


class SystemState(NamedTuple):
    """A snapshot of the graph.

    Attributes:
        publishers: the nodes that publish each topic.
        subscribers: the nodes that subscribe to each topic.
        services: the node that offers each service, as a list with one element.
    """

    publishers: Registrations
    subscribers: Registrations
    services: Registrations

    @classmethod
    def from_state(cls, state: Sequence[Sequence[Sequence[object]]]) -> SystemState:
        """Convert the response to the Master API's `getSystemState`."""
        publishers, subscribers, services = (_registrations(kind) for kind in state)
        return cls(publishers, subscribers, services)

    def topics(self) -> list[str]:
        """Return all topics that have a publisher or subscriber, sorted."""
        return sorted({*self.publishers, *self.subscribers})

    def nodes(self) -> list[str]:
        """Return all nodes that have a registration, sorted."""
        kinds = (self.publishers, self.subscribers, self.services)
        return sorted({node for kind in kinds for nodes in kind.values() for node in nodes})

    def of_topic(self, topic: str) -> SystemState:
        """Return the registrations of one topic, without services."""
        publishers, subscribers = (
            {topic: kind[topic]} if topic in kind else {} for kind in (self.publishers, self.subscribers)
        )
        return SystemState(publishers, subscribers, {})


class TopicConnection(NamedTuple):
    """A connection reported by a node: messages of `topic` flow from `publisher` to `subscriber`."""

    publisher: str
    topic: str
    subscriber: str


def _registrations(kind: Sequence[Sequence[object]]) -> dict[str, list[str]]:
    return {str(name): [str(node) for node in _each(nodes)] for name, nodes in kind}


def _each(nodes: object) -> Iterator[object]:
    return iter(nodes) if isinstance(nodes, (list, tuple)) else iter(())


def of_node(node: str, kind: Registrations) -> list[str]:
    """Return the topics or services for which `node` is registered, sorted."""
    return sorted(name for name, nodes in kind.items() if node in nodes)


def by_node(kind: Registrations) -> dict[str, list[str]]:
    """Return what `of_node` returns for each node that has a registration."""
    found: dict[str, list[str]] = {}
    for name in sorted(kind):
        for node in dict.fromkeys(kind[name]):
            found.setdefault(node, []).append(name)
    return found


def is_below(name: str, ns: str) -> bool:
    """Return whether `name` is `ns` or is inside it. Every name is in `/`.

    >>> is_below("/robot/scan", "/robot"), is_below("/robot2", "/robot"), is_below("/x", "/")
    (True, False, True)
    """
    return name == ns or name.startswith(ns if ns.endswith("/") else ns + "/")


def read_state(master: MasterClient) -> tuple[SystemState, dict[str, str]] | None:
    """Return a master's registrations and topic types, or None if it does not return a valid response."""
    try:
        state = SystemState.from_state(master.get_system_state())
        return state, {topic: kind for topic, kind in master.get_topic_types()}  # noqa: C416
    except (PiprosError, ValueError):
        return None
