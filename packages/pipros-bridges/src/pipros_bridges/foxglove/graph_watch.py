"""Watches the topics and services in the ROS graph, with their definitions, while clients are connected."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros_tools.graph.definitions import Definition, ServiceDefinition, TopicDefinitions
from pipros_tools.graph.node_queries import NodeQueries
from pipros_tools.graph.system_state import SystemState

SHORTEST_S: Final = 0.1
"""Interval between queries after a change. It doubles, up to `max_poll_s`, when a query finds no change."""
WAITING_S: Final = 1.0
"""Maximum interval between queries while peers have not answered."""
ANSWERS_S: Final = 0.3
"""Maximum time that a snapshot waits for peers whose definitions are unknown."""

Patterns = Sequence[re.Pattern[str]]


@dataclass(frozen=True, slots=True)
class GraphSnapshot:
    """Snapshot of the system, restricted to the names that clients may see.

    Attributes:
        state: registrations of the topics and services that clients may see.
        topics, services: the known definitions.
    """

    state: SystemState
    topics: Mapping[str, Definition]
    services: Mapping[str, ServiceDefinition]


def is_allowed(name: str, patterns: Patterns) -> bool:
    """Return whether a pattern matches the whole name."""
    return any(pattern.fullmatch(name) for pattern in patterns)


class GraphWatch:
    """Queries the graph in a thread while clients need it."""

    def __init__(
        self,
        master: MasterClient,
        definitions: TopicDefinitions,
        queries: NodeQueries,
        on_snapshot: Callable[[GraphSnapshot], object],
        *,
        topics: Patterns,
        services: Patterns,
        max_poll_s: float,
    ) -> None:
        """Initialize the watch without starting the thread.

        Args:
            queries: the queries of `definitions`.
            on_snapshot: called in the thread with each snapshot that differs from the previous one.
            topics, services: patterns of the names that clients may see.
            max_poll_s: maximum interval between queries.
        """
        self._master = master
        self._definitions = definitions
        self._queries = queries
        self._on_snapshot = on_snapshot
        self._topics = topics
        self._services = services
        self._max_poll_s = max(max_poll_s, SHORTEST_S)
        self._is_needed = False
        self._is_closed = False
        self._changed = threading.Condition()
        self._is_urgent = False

    def start(self) -> None:
        """Start the thread."""
        threading.Thread(target=self._run, name="graph watch", daemon=True).start()

    def close(self) -> None:
        """Signal the thread to stop, without waiting for it."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def set_needed(self, is_needed: bool) -> None:
        """Start or stop watching. If `is_needed`, the thread queries the graph immediately."""
        with self._changed:
            self._is_needed = self._is_urgent = is_needed
            self._changed.notify()

    def _run(self) -> None:
        interval_s = SHORTEST_S
        last: GraphSnapshot | None = None
        while True:
            with self._changed:
                if self._changed.wait_for(lambda: self._is_urgent or self._is_closed, interval_s):
                    interval_s = SHORTEST_S
                self._is_urgent = False
                self._changed.wait_for(lambda: self._is_needed or self._is_closed)
                if self._is_closed:
                    return
            try:
                snapshot = self.snapshot()
            except (PiprosError, ValueError):  # the master does not respond, or violates the protocol
                interval_s = min(2 * interval_s, self._max_poll_s)
                continue
            if snapshot == last:
                longest_s = min(WAITING_S, self._max_poll_s) if self._queries.is_running else self._max_poll_s
                interval_s = min(2 * interval_s, longest_s)
            else:
                last, interval_s = snapshot, SHORTEST_S
                self._on_snapshot(snapshot)

    def snapshot(self) -> GraphSnapshot:
        """Query the master, and the peers whose definitions are unknown.

        Blocks. Topics and services whose nodes do not answer within `ANSWERS_S` appear in a later snapshot.

        Raises:
            PiprosError: the master does not respond.
            ValueError: the master's response is malformed.
        """
        state = SystemState.from_state(self._master.get_system_state())
        kinds = {topic: kind for topic, kind in self._master.get_topic_types() if kind != "*"}
        state = SystemState(
            {name: nodes for name, nodes in state.publishers.items() if is_allowed(name, self._topics)},
            {name: nodes for name, nodes in state.subscribers.items() if is_allowed(name, self._topics)},
            {name: nodes for name, nodes in state.services.items() if is_allowed(name, self._services)},
        )
        self._definitions.forget_all_but({*state.publishers, *state.services})
        snapshot = self._snapshot(state, kinds)
        if self._queries.is_running:
            self._queries.wait(ANSWERS_S)
            snapshot = self._snapshot(state, kinds)
        return snapshot

    def _snapshot(self, state: SystemState, kinds: Mapping[str, str]) -> GraphSnapshot:
        """Return what is known, and start queries for the rest."""
        topics = {
            name: self._definitions.of_topic(name, kinds[name], nodes)
            for name, nodes in state.publishers.items()
            if name in kinds
        }
        services = {name: self._definitions.of_service(name, nodes) for name, nodes in state.services.items()}
        return GraphSnapshot(
            state,
            {name: found for name, found in topics.items() if found is not None},
            {name: found for name, found in services.items() if found is not None},
        )
