"""Observes a running system with a bounded rate of calls.

The master reports the registrations. Each node reports its connections (`getBusInfo`) and their traffic
(`getBusStats`); rates are computed from the difference between two responses.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.net.in_parallel import in_parallel
from pipros_tools.graph.bus_info import (
    BusConnection,
    SentCount,
    established,
    rows_of,
    sent_counts,
    statistics_of,
)
from pipros_tools.graph.node_clients import NodeClients
from pipros_tools.graph.system_state import SystemState, TopicConnection
from pipros_tools.graph.wrong_types import NodeTypes, WrongTypes

if TYPE_CHECKING:
    from pipros.net.master_client import MasterClient

Ask = Callable[[str], tuple[Any, Any]]


CALLS_PER_POLL = 60
"""Maximum number of nodes called per `poll`. The other nodes are called in later polls."""
ASKED_AT_ONCE = 16
"""Maximum number of concurrent calls; also of unresponsive nodes that are called again per `poll`."""
ANSWER_DEADLINE_S = 1.5
"""Timeout of a call; also the time after which a `poll` starts no more calls."""
NODE_INTERVAL_S = 1.0
"""Minimum interval (s) between calls to the same node."""
RATE_ANSWERS = 6
"""Number of a node's most recent responses over which a rate is computed."""
SLOWEST_RETRY_S = 8.0
"""Maximum pause before calling an unresponsive node again; the pause doubles with each failure."""


class Traffic(NamedTuple):
    """A connection's traffic.

    Attributes:
        rate, bandwidth: messages and bytes per second.
        quiet_s: time (s) since a message was last counted.
        interval_s: mean interval (s) between messages, computed whenever the message count has increased
            from each of the last `RATE_ANSWERS` responses to the next; None before the first time.
    """

    rate: float
    bandwidth: float
    quiet_s: float = 0.0
    interval_s: float | None = None


@dataclass(frozen=True, slots=True)
class ObservedNode:
    """State of a node.

    Attributes:
        uri: the URI of the node's slave API; empty while unknown.
        error: why the last request failed; empty if the node responded.
    """

    uri: str = ""
    error: str = ""


@dataclass(frozen=True, slots=True)
class GraphObservation:
    """Snapshot of the running system.

    Attributes:
        state: the registrations at the master.
        types: the type of each topic.
        nodes: the state of each registered node.
        connections: the connections with their traffic, which is None until it has been measured.
        transports: the transport of each connection: `TCPROS`, or the name of another protocol.
        wrong_types: missing connections whose ends have different types.
        error: why the master did not respond; empty if it responded. After a failure, all other attributes
            are those of the previous observation.
    """

    state: SystemState = field(default_factory=lambda: SystemState({}, {}, {}))
    types: Mapping[str, str] = field(default_factory=dict)
    nodes: Mapping[str, ObservedNode] = field(default_factory=dict)
    connections: Mapping[TopicConnection, Traffic | None] = field(default_factory=dict)
    transports: Mapping[TopicConnection, str] = field(default_factory=dict)
    wrong_types: Mapping[TopicConnection, WrongTypes] = field(default_factory=dict)
    error: str = ""

    @property
    def unreachable(self) -> set[str]:
        """The nodes that did not respond."""
        return {name for name, node in self.nodes.items() if node.error}


@dataclass(slots=True)
class _Node:
    """The observer's internal state for a node.

    Attributes:
        moved: by connection, the time (s) at which its message count last increased, and
            `Traffic.interval_s`.
    """

    uri: str = ""
    error: str = ""
    called_s: float = float("-inf")
    failures: int = 0
    links: Sequence[BusConnection] = ()
    counts: deque[tuple[float, Mapping[str, SentCount]]] = field(
        default_factory=lambda: deque(maxlen=RATE_ANSWERS)
    )
    moved: dict[str, tuple[float, float | None]] = field(default_factory=dict)

    def traffic(self, link: str) -> Traffic | None:
        """Return a connection's average traffic since the oldest stored response that contains it."""
        known = [(moment_s, counts[link]) for moment_s, counts in self.counts if link in counts]
        if len(known) < 2:
            return None
        (begin_s, first), (end_s, last) = known[0], known[-1]
        if end_s <= begin_s or last.messages < first.messages:
            return None
        elapsed_s = end_s - begin_s
        messages, size = last.messages - first.messages, last.bytes - first.bytes
        moved_s, interval_s = self.moved.get(link, (end_s, None))
        return Traffic(messages / elapsed_s, size / elapsed_s, end_s - moved_s, interval_s)

    def note(self, now_s: float, counts: Mapping[str, SentCount]) -> None:
        """Store a response, and update `moved` for each of its connections."""
        self.counts.append((now_s, counts))
        before, self.moved = self.moved, {}
        for link, count in counts.items():
            known = [(moment_s, each[link].messages) for moment_s, each in self.counts if link in each]
            moved_s, interval_s = before.get(link, (now_s, None))
            if len(known) > 1 and count.messages > known[-2][1]:
                moved_s = now_s
            if len(known) == RATE_ANSWERS and all(one[1] < other[1] for one, other in pairwise(known)):
                interval_s = (now_s - known[0][0]) / (count.messages - known[0][1])
            self.moved[link] = moved_s, interval_s

    def is_due(self, now_s: float) -> bool:
        wait = min(NODE_INTERVAL_S * 2**self.failures, SLOWEST_RETRY_S) if self.failures else NODE_INTERVAL_S
        return now_s - self.called_s >= wait


class SystemObserver:
    """Observes a running system. Call `poll` repeatedly, always from the same thread."""

    def __init__(
        self,
        master: MasterClient,
        *,
        clients: NodeClients | None = None,
        ask: Ask | None = None,
        ask_types: Ask | None = None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Store the arguments. No calls are made before `poll`.

        Args:
            clients: clients of the nodes' APIs; defaults to new clients.
            ask: function that returns the responses to `getBusInfo` and `getBusStats` from the node at a URI.
            ask_types: the same for `getPublications` and `getSubscriptions`.
            now_s: the clock for rates and retries.
        """
        self._master = master
        self._clients = clients or NodeClients(ANSWER_DEADLINE_S)
        self._query_node = ask or (lambda uri: self._call(uri, "getBusInfo", "getBusStats"))
        self._types = NodeTypes(
            ask_types or (lambda uri: self._call(uri, "getPublications", "getSubscriptions")), now_s
        )
        self._now_s = now_s
        self._nodes: dict[str, _Node] = {}
        self._last = GraphObservation()

    def poll(self) -> GraphObservation:
        """Query the master, and the nodes whose state is stale.

        Blocks until they respond or a deadline expires. If the master does not respond, return the previous
        observation with an `error`.
        """
        try:
            state = SystemState.from_state(self._master.get_system_state())
            types = {topic: kind for topic, kind in self._master.get_topic_types()}  # noqa: C416
        except (PiprosError, ValueError) as error:
            return replace(self._last, error=str(error))
        if state == self._last.state:
            state = self._last.state  # comparing an object with itself takes no time
        names = state.nodes()
        self._nodes = {name: self._nodes.get(name) or _Node() for name in names}
        now_s = self._now_s()
        until_s = now_s + ANSWER_DEADLINE_S
        due = sorted((node.called_s, name) for name, node in self._nodes.items() if node.is_due(now_s))
        silent = [name for _, name in due if self._nodes[name].failures][:ASKED_AT_ONCE]
        batch = self._chosen([name for _, name in due if not self._nodes[name].failures], len(silent))
        in_parallel(batch + silent, lambda name: self._query_until(until_s, name), at_once=ASKED_AT_ONCE)
        self._clients.keep_only({node.uri for node in self._nodes.values()})
        connections, transports = self._connections({*state.topics()})
        uris = {name: node.uri for name, node in self._nodes.items() if node.counts}  # nodes that answered
        self._last = GraphObservation(
            state,
            types,
            {name: ObservedNode(node.uri, node.error) for name, node in self._nodes.items()},
            connections,
            transports,
            self._types.find(state, uris, connections),
        )
        return self._last

    def _chosen(self, due: Sequence[str], silent: int) -> list[str]:
        """Return the nodes to call besides `silent` others: known ones first, whose rates would stand still.

        Half of the calls are for either kind, known or new, unless the other kind needs fewer.
        """
        known = [name for name in due if self._nodes[name].counts]
        new = [name for name in due if not self._nodes[name].counts]
        calls = CALLS_PER_POLL - silent
        known = known[: max(calls // 2, calls - len(new))]
        return known + new[: calls - len(known)]

    def _query_until(self, until_s: float, name: str) -> None:
        if self._now_s() <= until_s:
            self._query(name, self._nodes[name])

    def _query(self, name: str, node: _Node) -> None:
        node.called_s = now_s = self._now_s()
        try:
            if not node.uri or node.failures:
                node.uri = self._master.lookup_node(name)
            info, statistics = self._query_node(node.uri)
            links = list(established(rows_of(info, "getBusInfo")))
            counts = dict(sent_counts(statistics_of(statistics)))
        except (PiprosError, ValueError, OSError) as error:
            node.failures += 1
            node.error = printable(str(error))
            node.links = ()
            node.counts.clear()
            node.moved.clear()
            return
        node.failures, node.error = 0, ""
        node.links = links
        node.note(now_s, counts)

    def _call(self, uri: str, *methods: str) -> tuple[Any, Any]:
        with self._clients.client(uri) as api:
            first, second = (api.call(method, self._master.caller_id) for method in methods)
            return first, second

    def _connections(
        self, topics: Set[str]
    ) -> tuple[dict[TopicConnection, Traffic | None], dict[TopicConnection, str]]:
        """Return the traffic and the transports of connections between registered nodes.

        Connections on topics that are not registered at the master are left out.
        """
        names = {node.uri.rstrip("/"): name for name, node in self._nodes.items() if node.uri}
        connections: dict[TopicConnection, Traffic | None] = {}
        transports: dict[TopicConnection, str] = {}
        for name, node in self._nodes.items():
            for link in node.links:
                peer = names.get(link.peer.rstrip("/"), link.peer)
                if peer not in self._nodes or link.topic not in topics:
                    continue
                ends = (peer, name) if link.direction == "i" else (name, peer)
                connection = TopicConnection(ends[0], link.topic, ends[1])
                if link.direction in ("o", "b"):
                    connections[connection] = node.traffic(link.id)
                elif link.direction == "i":
                    connections.setdefault(connection, None)
                else:
                    continue
                transports[connection] = link.transport
        return connections, transports
