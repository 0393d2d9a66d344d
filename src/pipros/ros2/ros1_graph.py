"""What a gateway sees of ROS 1 in one look at the master and at the nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from pipros.basics.errors import PiprosError
from pipros.bridges.foxglove.catalog import Definition
from pipros.bridges.foxglove.definitions import Definitions
from pipros.fleet.local_graph import read_state
from pipros.graph.services import header_at, uri_of
from pipros.graph.system_state import ROS2_GATEWAY_PREFIX
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.service_client import OpenCalls

_REMEMBERED_SERVICES = 10_000


@dataclass(frozen=True, slots=True)
class Ros1Topic:
    """A topic that nodes other than gateways publish."""

    definition: Definition
    is_latched: bool
    publishers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Ros1Graph:
    """One look.

    Attributes:
        topics, services: by name; the value of a service is its type.
    """

    topics: Mapping[str, Ros1Topic] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)


class Ros1Looker:
    """Looks at ROS 1. All calls may block, with deadlines."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._calls = OpenCalls()
        self._loop = BackgroundLoop(f"definitions of {node.name}")
        self._definitions = Definitions(node, self._loop, self._calls)
        self._services: dict[tuple[str, tuple[str, ...]], str] = {}

    def start(self) -> None:
        """Start the loop that asks nodes."""
        self._loop.start()

    def look(self) -> Ros1Graph | None:
        """Return what is there now; None if the master does not answer."""
        found = read_state(self._node.master)
        if found is None:
            return None
        state, types = found
        topics = {}
        for name, nodes in state.publishers.items():
            publishers = _not_gateways(nodes)
            kind = types.get(name, "*")
            if publishers and "/" in kind:
                definition = self._definitions.of_topic(name, kind, publishers)
                if definition is not None:
                    is_latched = self._definitions.is_latched(name, publishers)
                    topics[name] = Ros1Topic(definition, is_latched, tuple(publishers))
        services = {}
        for name, nodes in state.services.items():
            providers = _not_gateways(nodes)
            service_type = self._service_type(name, providers) if providers else None
            if service_type is not None:
                services[name] = service_type
        self._definitions.forget_all_but({*state.publishers})
        return Ros1Graph(topics, services)

    def _service_type(self, name: str, providers: list[str]) -> str | None:
        key = name, tuple(providers)
        if key not in self._services:
            try:
                uri = uri_of(self._node.master, name)
                header = header_at(uri, name, self._node.name, self._calls) if uri is not None else {}
            except PiprosError:
                return None
            if "type" not in header:
                return None
            if len(self._services) >= _REMEMBERED_SERVICES:
                self._services.clear()
            self._services[key] = header["type"]
        return self._services[key]

    def close(self) -> None:
        self._calls.interrupt()
        self._loop.stop()


def _not_gateways(nodes: Iterable[str]) -> list[str]:
    return [node for node in nodes if not node.startswith(ROS2_GATEWAY_PREFIX)]
