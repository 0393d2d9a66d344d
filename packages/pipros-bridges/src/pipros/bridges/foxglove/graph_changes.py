"""Compute updates to the connection graph for the clients that display it. Performs no I/O."""

from __future__ import annotations

from pipros.bridges.foxglove import frames
from pipros.bridges.outbox import WebSocketFrame
from pipros.graph.system_state import Registrations, SystemState

EMPTY = SystemState({}, {}, {})


def graph_update(before: SystemState, after: SystemState) -> WebSocketFrame | None:
    """Return a message with the difference between two states, or None if the states are equal."""
    topics_before, services_before = {*before.publishers, *before.subscribers}, {*before.services}
    removed_topics = sorted(topics_before - {*after.publishers, *after.subscribers})
    removed_services = sorted(services_before - {*after.services})
    published = _changed(before.publishers, after.publishers, removed_topics)
    subscribed = _changed(before.subscribers, after.subscribers, removed_topics)
    services = _changed(before.services, after.services, removed_services)
    if not (published or subscribed or services or removed_topics or removed_services):
        return None
    return frames.connection_graph(
        published=published,
        subscribed=subscribed,
        services=services,
        removed_topics=removed_topics,
        removed_services=removed_services,
    )


def _changed(before: Registrations, after: Registrations, removed: list[str]) -> Registrations:
    """Return the current nodes of each name whose nodes have changed.

    A name that has lost all its nodes here, but still exists elsewhere in the graph, gets an empty list.
    """
    changed = {
        name: sorted(nodes) for name, nodes in after.items() if sorted(before.get(name, ())) != sorted(nodes)
    }
    gone: Registrations = {name: [] for name in before if name not in after and name not in removed}
    return {**changed, **gone}
