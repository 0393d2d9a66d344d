"""Compute updates to the connection graph for the clients that display it. Performs no I/O."""

from __future__ import annotations

from collections import deque

from pipros_bridges.foxglove import frames
from pipros_bridges.outbox import WebSocketFrame
from pipros_tools.graph.system_state import Registrations, SystemState

EMPTY = SystemState({}, {}, {})


class GraphUpdates:
    """Computes each update once, however many clients request it, and however often. Not thread-safe."""

    def __init__(self) -> None:
        self._newest = deque[tuple[SystemState, SystemState, WebSocketFrame | None]](maxlen=2)

    def find(self, before: SystemState, after: SystemState) -> WebSocketFrame | None:
        """Return what `graph_update` returns, which is kept for the latest two pairs of states."""
        for old, new, update in self._newest:
            if old is before and new is after:
                return update
        self._newest.append((before, after, graph_update(before, after)))
        return self._newest[-1][2]


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
