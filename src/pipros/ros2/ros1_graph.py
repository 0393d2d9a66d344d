"""What a gateway sees of ROS 1 in one look at the master and at the nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from pipros.basics.errors import PiprosError
from pipros.bridges.foxglove.catalog import Definition
from pipros.bridges.foxglove.definitions import Definitions
from pipros.fleet.local_graph import read_state
from pipros.graph.services import header_at, uri_of
from pipros.graph.system_state import ROS2_GATEWAY_PREFIX, Registrations
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.service_client import OpenCalls

_REMEMBERED_SERVICES = 10_000
_STATUSES = "actionlib_msgs/GoalStatusArray"
_PARTS = {
    "goal": "ActionGoal",
    "cancel": "actionlib_msgs/GoalID",
    "status": _STATUSES,
    "result": "ActionResult",
    "feedback": "ActionFeedback",
}
"""The types of an action's topics, or what they end in."""


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
        topics, services, actions: by name. The value of a service or an action is its type.
    """

    topics: Mapping[str, Ros1Topic] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)


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
        return Ros1Graph(topics, services, actions_of(topics, state.subscribers))

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


def actions_of(topics: Mapping[str, Ros1Topic], subscribers: Registrations) -> dict[str, str]:
    """Return the actions that have a server, with types such as `nav_msgs/GetMap`.

    A server publishes `NAME/status` and `NAME/result`, and subscribes to `NAME/goal`.
    """
    found = {}
    for topic, result in topics.items():
        name, kind = topic.removesuffix("/result"), result.definition.type
        action = kind.removesuffix("ActionResult")
        status = topics.get(f"{name}/status")
        if name == topic or action == kind or status is None:
            continue
        servers = {*result.publishers} & {*status.publishers} & {*subscribers.get(f"{name}/goal", ())}
        if status.definition.type == _STATUSES and servers:
            found[name] = action
    return found


def is_part_of_action(topic: str, kind: str) -> bool:
    """Return whether a topic belongs to an action of ROS 1."""
    last = topic.rpartition("/")[2]
    return _PARTS.get(last, "-") in (kind, _suffix(kind))


def _suffix(kind: str) -> str:
    """Return the part of an action's message type behind the name of the action."""
    return next(
        (each for each in ("ActionGoal", "ActionResult", "ActionFeedback") if kind.endswith(each)), ""
    )


def _not_gateways(nodes: Iterable[str]) -> list[str]:
    return [node for node in nodes if not node.startswith(ROS2_GATEWAY_PREFIX)]
