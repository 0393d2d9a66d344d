"""Recently added or removed nodes and topics, determined from successive observations.

The master deletes a node's registrations immediately, so users would otherwise not notice that a node has
ended.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping, Set
from dataclasses import dataclass, replace
from typing import Literal

from pipros_tools.graph.observer import GraphObservation, Traffic
from pipros_tools.graph.system_state import Registrations, SystemState, TopicConnection

Kind = Literal["node", "topic"]
Part = tuple[Kind, str]
"""A node or topic, given by its kind and name."""

SHOWN_S = 120.0
"""How long removed nodes and topics are included in `with_removed`."""
EVENTS_S = 600.0
"""How long `events` reports a change."""
DYING_S = 20.0
"""Connections that a node had within this time before its removal are kept, because a node that has
crashed stops reporting its connections some time before the master removes the node.
"""
MAX_EVENTS = 500
MAX_REMOVED = 1000
"""Maximum number of removed nodes and topics that are kept; the oldest are dropped first."""
LONGEST_GAP_S = 10.0
"""After a longer time without observations, the next observation is not compared with the previous one."""


@dataclass(frozen=True, slots=True)
class GraphEvent:
    """The addition or removal of a node or topic, with its wall time in s."""

    when_s: float
    is_added: bool
    part: Part


@dataclass(frozen=True, slots=True)
class _Removal:
    """Nodes and topics that were removed together, with all their registrations and connections."""

    when_s: float
    parts: frozenset[Part]
    publishers: tuple[tuple[str, str], ...]
    subscribers: tuple[tuple[str, str], ...]
    connections: tuple[TopicConnection, ...]


class RecentChanges:
    """Compares observations. Not thread-safe."""

    def __init__(self) -> None:
        """Create an empty history. The first observation is only a baseline for the next one."""
        self._last: GraphObservation | None = None
        self._last_s = 0.0
        self._parts: frozenset[Part] = frozenset()
        self._connected_s: dict[TopicConnection, float] = {}
        self._events: deque[GraphEvent] = deque(maxlen=MAX_EVENTS)
        self._removals: list[_Removal] = []

    def add(self, observation: GraphObservation, now_s: float) -> None:
        """Compare an observation, made at the wall time `now_s`, with the previous observation."""
        if observation.error:
            return
        last, gap_s = self._last, now_s - self._last_s
        self._last, self._last_s = observation, now_s
        before = parts = self._parts
        if last is None or observation.state is not last.state:
            parts = self._parts = _parts_of(observation.state)
        self._connected_s = {
            **{
                connection: seen_s
                for connection, seen_s in self._connected_s.items()
                if now_s - seen_s < DYING_S
            },
            **dict.fromkeys(observation.connections, now_s),
        }
        if last is None or gap_s > LONGEST_GAP_S:
            self._removals.clear()
            return
        for is_added, changed in ((True, parts - before), (False, before - parts)):
            self._events.extend(GraphEvent(now_s, is_added, part) for part in sorted(changed))
        if removed := before - parts:
            self._removals.append(_removal(last.state, self._connected_s, removed, now_s))
        self._forget(now_s)

    def events(self, now_s: float) -> list[GraphEvent]:
        """Return the changes of the last ten minutes, newest first."""
        return [event for event in reversed(self._events) if now_s - event.when_s < EVENTS_S]

    def removed(self) -> Mapping[Part, float]:
        """Return the removed nodes and topics, with the wall times of their removal."""
        gone = {part: removal.when_s for removal in self._removals for part in removal.parts}
        return {part: when_s for part, when_s in gone.items() if part not in self._parts}

    def with_removed(self, observation: GraphObservation) -> GraphObservation:
        """Return an observation that includes the removed nodes and topics with their last connections."""
        gone = self.removed()
        if not gone:
            return observation
        known = {*self._parts, *gone}
        state = observation.state
        publishers: dict[str, list[str]] = {}
        subscribers: dict[str, list[str]] = {}
        connections: dict[TopicConnection, Traffic | None] = {}
        for removal in self._removals:
            for kept, found in ((publishers, removal.publishers), (subscribers, removal.subscribers)):
                for topic, node in found:
                    if {("topic", topic), ("node", node)} <= known and _any_gone(gone, topic, node):
                        kept.setdefault(topic, []).append(node)
            connections |= {
                connection: None
                for connection in removal.connections
                if _any_gone(gone, connection.topic, connection.publisher, connection.subscriber)
            }
        return replace(
            observation,
            state=SystemState(
                _joined(state.publishers, publishers), _joined(state.subscribers, subscribers), state.services
            ),
            connections={**connections, **observation.connections},
        )

    def _forget(self, now_s: float) -> None:
        self._removals = [removal for removal in self._removals if now_s - removal.when_s < SHOWN_S]
        while sum(len(removal.parts) for removal in self._removals) > MAX_REMOVED:
            del self._removals[0]


def _parts_of(state: SystemState) -> frozenset[Part]:
    nodes: set[Part] = {("node", name) for name in state.nodes()}
    topics: set[Part] = {("topic", name) for name in state.topics()}
    return frozenset(nodes | topics)


def _removal(
    last: SystemState, connected: Iterable[TopicConnection], parts: Set[Part], now_s: float
) -> _Removal:
    def mentioned(kind: Registrations) -> tuple[tuple[str, str], ...]:
        return tuple(
            (topic, node) for topic, nodes in kind.items() for node in nodes if _any_gone(parts, topic, node)
        )

    connections = tuple(
        connection
        for connection in connected
        if _any_gone(parts, connection.topic, connection.publisher, connection.subscriber)
    )
    return _Removal(
        now_s,
        frozenset(parts),
        mentioned(last.publishers),
        mentioned(last.subscribers),
        connections,
    )


def _any_gone(gone: Collection[Part], topic: str, *nodes: str) -> bool:
    return ("topic", topic) in gone or any(("node", node) in gone for node in nodes)


def _joined(present: Registrations, removed: Registrations) -> Registrations:
    joined = {topic: list(nodes) for topic, nodes in present.items()}
    for topic, nodes in removed.items():
        known = joined.setdefault(topic, [])
        known += [node for node in dict.fromkeys(nodes) if node not in known]
    return joined
