"""Questions that tests ask about the graph: who publishes and who subscribes to a topic."""

from __future__ import annotations

from pipros.graph.client import GraphClient
from pipros.graph.system_state import SystemState


def is_publisher(topic: str, node: str, tool: str) -> bool:
    """True when the master knows `node` as a publisher of `topic`.

    `tool` is the name, without a namespace, that the question is asked by and names are resolved for.

    Raises:
        Unreachable: no master answers.
    """
    with GraphClient(tool) as graph:
        publishers = SystemState.from_state(graph.master.get_system_state()).publishers
        return graph.resolve(node) in publishers.get(graph.resolve(topic), ())


def is_subscriber(topic: str, node: str, tool: str) -> bool:
    """True when the master knows `node` as a subscriber of `topic`; otherwise as `is_publisher`."""
    with GraphClient(tool) as graph:
        subscribers = SystemState.from_state(graph.master.get_system_state()).subscribers
        return graph.resolve(node) in subscribers.get(graph.resolve(topic), ())
