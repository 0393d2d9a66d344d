"""Find publishers and subscribers of a topic that are not connected because their types differ.

The master stores one type per topic, usually that of the publisher that registered last. Each node reports
its own types, but is queried only while it lacks an expected connection.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import islice
from typing import Any, NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.net.in_parallel import in_parallel
from pipros_tools.graph.bus_info import rows_of
from pipros_tools.graph.system_state import SystemState, TopicConnection

Ask = Callable[[str], tuple[Any, Any]]
"""Returns the responses to `getPublications` and `getSubscriptions` of the node at a URI."""

VALID_S = 5.0
"""How long (s) a node's response is used before the node is queried again."""
CALLS_PER_UPDATE = 20
"""Maximum number of nodes queried per `find`. The others are queried by later calls."""
MAX_PAIRS = 2000
"""Maximum number of pairs without a connection that are examined."""
AT_ONCE = 6


class WrongTypes(NamedTuple):
    """The type that a publisher sends, and the different type that a subscriber expects."""

    sent: str
    wanted: str

    @property
    def text(self) -> str:
        return f"sent {self.sent}, wanted {self.wanted}"


class _Types(NamedTuple):
    asked_s: float
    uri: str
    published: Mapping[str, str]
    subscribed: Mapping[str, str]


class NodeTypes:
    """The types of the nodes that lack connections. Not thread-safe."""

    def __init__(self, ask: Ask, now_s: Callable[[], float] = time.monotonic) -> None:
        self._ask = ask
        self._now_s = now_s
        self._known: dict[str, _Types] = {}

    def find(
        self, state: SystemState, uris: Mapping[str, str], connections: Collection[TopicConnection]
    ) -> dict[TopicConnection, WrongTypes]:
        """Return the missing connections whose ends have different types.

        Args:
            uris: the nodes that answer, with the URIs of their APIs.
            connections: the connections that exist.
        """
        missing = [*islice(_missing(state, uris, connections), MAX_PAIRS)]
        wanted = dict.fromkeys(node for each in missing for node in (each.publisher, each.subscriber))
        self._known = {node: self._known[node] for node in wanted if node in self._known}
        now_s = self._now_s()
        due = [node for node in wanted if not self._is_valid(node, uris[node], now_s)][:CALLS_PER_UPDATE]
        self._known |= in_parallel(due, lambda node: self._query(uris[node], now_s), at_once=AT_ONCE)
        found = {}
        for each in missing:
            if each.publisher in self._known and each.subscriber in self._known:
                sent = self._known[each.publisher].published.get(each.topic, "")
                wants = self._known[each.subscriber].subscribed.get(each.topic, "")
                if sent != wants and not {"", "*"} & {sent, wants}:
                    found[each] = WrongTypes(sent, wants)
        return found

    def _is_valid(self, node: str, uri: str, now_s: float) -> bool:
        known = self._known.get(node)
        return known is not None and known.uri == uri and now_s - known.asked_s < VALID_S

    def _query(self, uri: str, now_s: float) -> _Types:
        try:
            published, subscribed = self._ask(uri)
            return _Types(
                now_s,
                uri,
                _types_of(rows_of(published, "getPublications")),
                _types_of(rows_of(subscribed, "getSubscriptions")),
            )
        except (PiprosError, ValueError, OSError):
            return _Types(now_s, uri, {}, {})


def _missing(
    state: SystemState, uris: Mapping[str, str], connections: Collection[TopicConnection]
) -> Iterator[TopicConnection]:
    for topic, publishers in state.publishers.items():
        subscribers = [node for node in state.subscribers.get(topic, ()) if node in uris]
        for publisher in publishers if subscribers else ():
            if publisher in uris:
                for subscriber in subscribers:
                    connection = TopicConnection(publisher, topic, subscriber)
                    if connection not in connections:
                        yield connection


def _types_of(rows: list[Any]) -> dict[str, str]:
    pairs = (row for row in rows if isinstance(row, list) and len(row) == 2)
    return {str(topic): printable(str(kind), 300) for topic, kind in pairs}
