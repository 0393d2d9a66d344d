"""The `BridgeServer` handler for the Foxglove protocol, with the state that its clients share."""

from __future__ import annotations

import contextlib
import re
import secrets
import struct
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from pipros.basics.errors import Refused
from pipros.basics.printable import printable
from pipros.msg.time import NS_PER_S
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.clock import SimulatedClock
from pipros.node.open_calls import OpenCalls
from pipros.packages.assets import AssetRefused, read_asset
from pipros_bridges.call_turns import CallTurns
from pipros_bridges.client import BridgeClient
from pipros_bridges.foxglove import frames
from pipros_bridges.foxglove.catalog import TopicCatalog
from pipros_bridges.foxglove.graph_changes import EMPTY, GraphUpdates
from pipros_bridges.foxglove.graph_watch import GraphSnapshot, GraphWatch, is_allowed
from pipros_bridges.foxglove.parameter_watch import Changes, ParameterWatch
from pipros_bridges.foxglove.parameters import flattened, outermost
from pipros_bridges.foxglove.publishing import ENCODINGS
from pipros_bridges.foxglove.sent_assets import Asset, SentAssets
from pipros_bridges.foxglove.session import TIME_KEY, FoxgloveSession
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import WebSocketFrame
from pipros_bridges.shared_topics import SharedTopics, TopicMessage
from pipros_server.act_gate import ActGate
from pipros_server.daemon_pool import DaemonPool
from pipros_tools.graph.definitions import TopicDefinitions
from pipros_tools.graph.node_queries import NodeQueries
from pipros_tools.graph.system_state import SystemState
from pipros_workspace.index import PackageIndex

BRIDGE_ASSET_BYTES = 48 * 1024 * 1024
"""Limit: an asset that a Foxglove client fetches. All assets that are being sent may together be twice as
large. Beyond it, the asset is refused; a further asset is also refused while all assets being sent would
together exceed twice the limit.
"""

SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Versions of the protocol, in the order of preference. These two have the same messages under two names; a
version with other messages needs its own handler in `Protocols.handlers`.
"""
CALLS_AT_ONCE: Final = 256
"""Maximum number of concurrent service calls by all clients, plus one per client. Further calls wait."""
FETCHED_APART: Final = 20
"""Maximum number of parameters that are fetched one by one; for more of them, all are fetched at once."""
ALL: Final = ("/",)
_CLOCK = struct.Struct("<II")

READING = ("parameters", "parametersSubscribe", "connectionGraph", "assets")
CHANGING = ("clientPublish", "services")
"""Capabilities of the protocol: `CHANGING` requires control; `READING` does not, except to set parameters."""
CAPABILITIES: Final = (*READING, *CHANGING)


@dataclass(frozen=True, slots=True)
class Rules:
    """Permissions of the clients of a Foxglove server.

    Attributes:
        topics, services, parameters: patterns that must match the whole name.
        published: patterns that the topics on which clients publish must match, too.
        assets: patterns that must match the whole URI of an asset.
        has_control: whether clients may publish, call services and set parameters.
        capabilities: the offered subset of `CAPABILITIES`.
        max_poll_s: maximum interval between two queries of the graph.
    """

    topics: Sequence[re.Pattern[str]] = (re.compile(".*"),)
    services: Sequence[re.Pattern[str]] = (re.compile(".*"),)
    parameters: Sequence[re.Pattern[str]] = (re.compile(".*"),)
    has_control: bool = False
    capabilities: Sequence[str] = CAPABILITIES
    max_poll_s: float = 5.0
    published: Sequence[re.Pattern[str]] = (re.compile(".*"),)
    assets: Sequence[re.Pattern[str]] = (re.compile(".*"),)


class FoxgloveHandler:
    """The sessions of all Foxglove clients, and their shared state. For use in the event loop."""

    def __init__(
        self,
        node: Node,
        loop: BackgroundLoop,
        rules: Rules,
        topics: SharedTopics | None = None,
        gate: ActGate | None = None,
    ) -> None:
        """Create a handler. `loop` is the server's event loop.

        `topics` and `gate` may be shared with other handlers; the default gate allows everything.
        """
        self.node = node
        self.gate = gate or ActGate(node)
        self.gate.start()
        self._rules = rules
        self.topics = topics or SharedTopics(node)
        self.catalog = TopicCatalog()
        self.state: SystemState = EMPTY
        self.graph_updates = GraphUpdates()
        self.has_control = rules.has_control
        self.threads = DaemonPool("foxglove client", node.limits.of(BridgeLimits).bridge_clients)
        self.call_turns = CallTurns("foxglove call", CALLS_AT_ONCE)
        self._assets = SentAssets(BRIDGE_ASSET_BYTES)
        self._all_parameters = SharedAnswer(self._query_parameters)
        self._some_parameters = SharedAnswer(self._query_parameters)
        self._loop = loop
        self._sessions: dict[FoxgloveSession, BridgeClient] = {}
        self._calls = OpenCalls()
        self._queries = NodeQueries("graph query")
        self._definitions = TopicDefinitions(node, loop, self._calls, self._queries)
        self._parameter_watch = ParameterWatch(node, self._on_parameters)
        self._packages = PackageIndex.from_environment(node.environment)
        self._graph_watch = GraphWatch(
            node.master,
            self._definitions,
            self._queries,
            self._on_snapshot,
            topics=rules.topics,
            services=rules.services if self.offers("services") else (),
            max_poll_s=rules.max_poll_s,
        )
        self._session_id = secrets.token_hex(8)
        self._offers: tuple[WebSocketFrame, ...] = ()  # for new clients; empty after a change

    def start(self) -> None:
        """Start watching the graph, and subscribe to `/clock` if time is simulated."""
        self._graph_watch.start()
        if isinstance(self.node.clock, SimulatedClock):
            self.topics.take("/clock", "rosgraph_msgs/Clock", self._on_clock)

    def close(self) -> None:
        """Stop the threads, close the gate, and interrupt pending calls."""
        self.gate.close()
        self._graph_watch.close()
        self._queries.close()
        self._parameter_watch.close()
        self._calls.interrupt()

    def open(self, client: BridgeClient) -> FoxgloveSession:
        """Start a session for a client: send it all channels and services."""
        session = FoxgloveSession(client, self)
        capabilities = [each for each in CAPABILITIES if self.offers(each)]
        if isinstance(self.node.clock, SimulatedClock):
            capabilities.append("time")
        metadata = {"ROS_DISTRO": "noetic"}
        self._offers = self._offers or (
            frames.advertise(self.catalog.channels.values()),
            frames.advertise_services(self.catalog.services.values()),
        )
        client.send(
            frames.server_info("foxglove_bridge", capabilities, ENCODINGS, metadata, self._session_id),
            *self._offers,
        )
        self._sessions[session] = client
        self._graph_watch.set_needed(True)
        return session

    def is_login(self, first: str | bytes) -> bool:  # noqa: ARG002
        """Return False, because the protocol does not define a login."""
        return False

    def leave(self, session: FoxgloveSession) -> None:
        """Remove the session of a client that has disconnected."""
        self._sessions.pop(session, None)
        self.watch_parameters()
        if not self._sessions:
            self._graph_watch.set_needed(False)

    # -- for sessions -------------------------------------------------------------------

    def offers(self, capability: str) -> bool:
        """Return whether clients may use a capability."""
        return capability in self._rules.capabilities and (self.has_control or capability not in CHANGING)

    def allows_topic(self, name: str) -> bool:
        return is_allowed(name, self._rules.topics)

    def allows_publishing(self, name: str) -> bool:
        return self.allows_topic(name) and is_allowed(name, self._rules.published)

    def allows_parameter(self, name: str) -> bool:
        return is_allowed(name, self._rules.parameters)

    def correct(self, topic: str, header: Mapping[str, str]) -> None:
        """Replace a topic's definition with the one in a publisher's header. Called in a link's thread."""
        if self._definitions.correct(topic, header):
            self._graph_watch.set_needed(True)

    def watch_parameters(self) -> None:
        """Watch the parameters if any session subscribes to parameters; otherwise stop watching."""
        self._parameter_watch.set_needed(any(session.takes_parameters for session in self._sessions))

    def parameters(self, names: Collection[str] = ()) -> Mapping[str, Any]:
        """Return all parameters that clients may see, or at least those with these full names. Blocks."""
        roots = outermost(names)
        if 0 < len(roots) <= FETCHED_APART and roots != ALL:
            return self._some_parameters.get(roots)
        return self._all_parameters.get(ALL)

    def _query_parameters(self, roots: Sequence[str]) -> Mapping[str, Any]:
        found: dict[str, Any] = {}
        for root in roots:
            with contextlib.suppress(Refused):  # it is not set
                found |= flattened(self.node.master.get_param(root), root)
        return {name: value for name, value in found.items() if self.allows_parameter(name)}

    def read_asset(self, uri: str) -> Asset:
        """Return an asset. Blocks; raises `AssetRefused`."""
        if not is_allowed(uri, self._rules.assets):
            raise AssetRefused(f"asset_uri_allowlist does not allow [{printable(uri)}]")
        return read_asset(uri, self._folders_of, BRIDGE_ASSET_BYTES, self._assets.read)

    def _folders_of(self, package: str) -> Sequence[Path]:
        found = self._packages.get(package)
        return () if found is None else (found.path,)

    # -- reports from the threads ---------------------------------------------------------

    def _on_snapshot(self, snapshot: GraphSnapshot) -> None:
        self._loop.call(self._apply, snapshot)

    def _apply(self, snapshot: GraphSnapshot) -> None:
        channels = self.catalog.update_channels(snapshot.topics)
        services = self.catalog.update_services(snapshot.services)
        self._offers = ()
        news = []
        if channels.removed:
            news.append(frames.unadvertise(channels.removed))
        if channels.added:
            news.append(frames.advertise(channels.added))
        if services.removed:
            news.append(frames.unadvertise_services(services.removed))
        if services.added:
            news.append(frames.advertise_services(services.added))
        self.state = snapshot.state
        for session, client in self._sessions.items():
            session.remove_channels(channels.removed)
            for frame in news:
                client.send(frame)
            session.show_graph(snapshot.state)

    def _on_parameters(self, changes: Changes) -> None:
        allowed = {name: value for name, value in changes.items() if self.allows_parameter(name)}
        self._loop.call(self._show_parameters, allowed)

    def _show_parameters(self, changes: Changes) -> None:
        for session in self._sessions:
            session.show_parameters(changes)

    def _on_clock(self, message: TopicMessage) -> None:
        with contextlib.suppress(struct.error):
            seconds, nanoseconds = _CLOCK.unpack_from(message.body)
            self._loop.call(self._show_time, frames.time(seconds * NS_PER_S + nanoseconds))

    def _show_time(self, frame: Any) -> None:
        for client in self._sessions.values():
            client.outbox.put(TIME_KEY, frame)


K = TypeVar("K")
T = TypeVar("T")


class SharedAnswer(Generic[K, T]):
    """Runs one query at a time, and drops its result when no caller waits any more. Thread-safe.

    Every call to `get` returns the result of a query with the same key that began after the call.
    """

    def __init__(self, query: Callable[[K], T]) -> None:
        self._query = query
        self._lock = threading.Lock()
        self._newest: tuple[float, K, T] | None = None
        self._waiting = 0
        self._counting = threading.Lock()

    def get(self, key: K) -> T:
        """Return the result of a query. Blocks; raises the errors of the query."""
        asked_s = time.monotonic()
        with self._counting:
            self._waiting += 1
        try:
            with self._lock:
                newest = self._newest
                if newest is None or newest[0] < asked_s or newest[1] != key:
                    self._newest = None
                    newest = self._newest = time.monotonic(), key, self._query(key)
                return newest[2]
        finally:
            with self._counting:
                self._waiting -= 1
                if not self._waiting:
                    self._newest = None
