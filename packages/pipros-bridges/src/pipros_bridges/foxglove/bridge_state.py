"""What the sessions of all Foxglove clients share."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final, Protocol

from pipros.basics.errors import LimitExceeded
from pipros.node import Node
from pipros_bridges.call_turns import CallTurns
from pipros_bridges.foxglove.catalog import TopicCatalog
from pipros_bridges.foxglove.graph_changes import GraphUpdates
from pipros_bridges.foxglove.sent_assets import Asset
from pipros_bridges.shared_topics import SharedTopics
from pipros_bridges.shares import BRIDGE_SUBSCRIPTIONS
from pipros_server.act_gate import ActGate
from pipros_server.daemon_pool import DaemonPool
from pipros_tools.graph.system_state import SystemState

READ_ONLY: Final = "this server is read-only; start it with --control to change the system"


class FoxgloveBridge(Protocol):
    """State that is shared by all sessions: the part of `FoxgloveHandler`, which opens them, that they use.

    It is a protocol because the handler imports the module of the sessions.

    Attributes:
        has_control: whether clients may publish, call services and set parameters.
        threads: threads for work that may block briefly, enough for all clients.
        call_turns: threads for service calls, which may block for a long time.
    """

    node: Node
    gate: ActGate
    topics: SharedTopics
    catalog: TopicCatalog
    state: SystemState
    graph_updates: GraphUpdates
    has_control: bool
    threads: DaemonPool
    call_turns: CallTurns

    def offers(self, capability: str) -> bool: ...
    def allows_publishing(self, name: str) -> bool: ...
    def allows_parameter(self, name: str) -> bool: ...
    def leave(self, session: Any) -> None: ...
    def correct(self, topic: str, header: Mapping[str, str]) -> object: ...
    def watch_parameters(self) -> None: ...
    def parameters(self, names: Collection[str] = ()) -> Mapping[str, Any]: ...
    def read_asset(self, uri: str) -> Asset: ...


def check_limit(count: int) -> None:
    """Raise `LimitExceeded` if a client has `count` subscriptions or publications, and wants another one."""
    if count >= BRIDGE_SUBSCRIPTIONS:
        limit = f"the limit is {BRIDGE_SUBSCRIPTIONS}"
        raise LimitExceeded(f"too many subscriptions or advertised channels; {limit}")
