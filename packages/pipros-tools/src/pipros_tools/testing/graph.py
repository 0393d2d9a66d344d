"""Determine, for tests, whether a node publishes a topic or subscribes to it."""

from __future__ import annotations

from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.system_state import SystemState


def is_publisher(topic: str, node: str, tool: str) -> bool:
    """Return True if `node` is registered as a publisher of `topic`.

    `tool` is the caller's node name without a namespace. `topic` and `node` are resolved as in that node.

    Raises:
        Unreachable: the master does not respond.
    """
    with GraphClient(tool) as graph:
        publishers = SystemState.from_state(graph.master.get_system_state()).publishers
        return graph.resolve(node) in publishers.get(graph.resolve(topic), ())


def is_subscriber(topic: str, node: str, tool: str) -> bool:
    """Return True if `node` is registered as a subscriber to `topic`. See `is_publisher`."""
    with GraphClient(tool) as graph:
        subscribers = SystemState.from_state(graph.master.get_system_state()).subscribers
        return graph.resolve(node) in subscribers.get(graph.resolve(topic), ())
