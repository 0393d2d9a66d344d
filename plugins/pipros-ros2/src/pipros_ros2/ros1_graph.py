"""The ROS 1 topics, services and actions that a gateway can forward."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros_rosbag2.names import GATEWAY_PREFIX
from pipros_tools.graph.definitions import Definition, TopicDefinitions
from pipros_tools.graph.node_queries import NodeQueries
from pipros_tools.graph.services import header_at, uri_of
from pipros_tools.graph.system_state import Registrations, read_state

_ANSWERS_S = 0.3
"""Maximum time that `poll` waits for nodes to respond."""
_RESTART_S = 5.0
"""How long an action is still forwarded after its server has gone.

If the gateway closed and reopened the action's topics while the server restarts, a rospy server that is just
connecting to these topics could lose a connection: rospy ignores an update about a publisher whose last
connection it has not yet removed.
"""
_Key = tuple[str, str, tuple[str, ...]]
"""Name, type (empty for services) and nodes of a topic or service."""
_STATUSES = "actionlib_msgs/GoalStatusArray"
_PARTS = {
    "goal": "ActionGoal",
    "cancel": "actionlib_msgs/GoalID",
    "status": _STATUSES,
    "result": "ActionResult",
    "feedback": "ActionFeedback",
}
"""The types of an action's topics, or their suffixes."""


@dataclass(frozen=True, slots=True)
class Ros1Topic:
    """A topic that nodes other than gateways publish."""

    definition: Definition
    is_latched: bool
    publishers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Ros1Graph:
    """A snapshot of ROS 1.

    Attributes:
        topics, services, actions: by name. The value of a service or an action is its type.
    """

    topics: Mapping[str, Ros1Topic] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)


class Ros1Poller:
    """Takes snapshots of a ROS 1 system. All calls may block, but only for a limited time."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._calls = OpenCalls()
        self._loop = BackgroundLoop(f"definitions of {node.name}")
        self._definitions = TopicDefinitions(node, self._loop, self._calls)
        self._queries = NodeQueries(f"queries of {node.name}")
        self._topics: dict[str, Ros1Topic] = {}
        self._actions: dict[str, tuple[str, float]] = {}  # type, and time when its server was last seen

    def start(self) -> None:
        """Start the loop that queries publishers."""
        self._loop.start()

    def poll(self) -> Ros1Graph | None:
        """Return the current graph, or None if the master does not answer.

        Topics and services whose nodes do not answer within `_ANSWERS_S` appear in a later graph. If
        a topic gains a publisher, its old definition is returned until all its publishers have answered.
        """
        found = read_state(self._node.master)
        if found is None:
            return None
        state, types = found
        topics: dict[_Key, str] = {}
        services: dict[_Key, str] = {}
        for name, nodes in state.publishers.items():
            publishers, kind = _not_gateways(nodes), types.get(name, "*")
            if publishers and "/" in kind:
                key = name, kind, tuple(publishers)
                topics[key] = name
                self._queries.ask(key, partial(self._topic, *key))
        for name, nodes in state.services.items():
            providers = _not_gateways(nodes)
            if providers:
                key = name, "", tuple(providers)
                services[key] = name
                if self._queries.answer(key) is None:  # known types are kept
                    self._queries.ask(key, partial(self._service_type, name))
        self._queries.wait(_ANSWERS_S)
        self._queries.forget_all_but({*topics, *services}.__contains__)
        self._definitions.forget_all_but({*state.publishers})
        self._topics = found_topics = self._kept(topics) | self._answered(topics)
        actions = self._with_restarting(actions_of(found_topics, state.subscribers))
        return Ros1Graph(found_topics, self._answered(services), actions)

    def _with_restarting(self, actions: Mapping[str, str]) -> dict[str, str]:
        """Add the actions whose server has been gone for less than `_RESTART_S`."""
        now_s = time.monotonic()
        self._actions |= {name: (kind, now_s) for name, kind in actions.items()}
        self._actions = {name: seen for name, seen in self._actions.items() if now_s - seen[1] < _RESTART_S}
        return {name: kind for name, (kind, _) in self._actions.items()}

    def _kept(self, names: Mapping[_Key, str]) -> dict[str, Ros1Topic]:
        """Return the topics of the last graph whose type and at least one publisher are unchanged."""
        kept = {}
        for name, kind, publishers in names:
            last = self._topics.get(name)
            if last is not None and last.definition.type == kind and {*last.publishers} & {*publishers}:
                kept[name] = replace(last, publishers=publishers)
        return kept

    def _answered(self, names: Mapping[_Key, str]) -> dict[str, Any]:
        answers = {name: self._queries.answer(key) for key, name in names.items()}
        return {name: answer for name, answer in answers.items() if answer is not None}

    def _topic(self, name: str, kind: str, publishers: tuple[str, ...]) -> Ros1Topic | None:
        definition = self._definitions.of_topic(name, kind, publishers)
        if definition is None:
            return None
        return Ros1Topic(definition, self._definitions.is_latched(name, publishers), publishers)

    def _service_type(self, name: str) -> str | None:
        try:
            uri = uri_of(self._node.master, name)
            header = header_at(uri, name, self._node.name, self._calls) if uri is not None else {}
        except PiprosError:
            return None
        return header.get("type")

    def close(self) -> None:
        self._queries.close()
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
    """Return whether a topic belongs to a ROS 1 action."""
    last = topic.rpartition("/")[2]
    return _PARTS.get(last, "-") in (kind, _suffix(kind))


def _suffix(kind: str) -> str:
    """Return the suffix of an action message type, such as `ActionGoal`; for other types, an empty string."""
    return next(
        (each for each in ("ActionGoal", "ActionResult", "ActionFeedback") if kind.endswith(each)), ""
    )


def _not_gateways(nodes: Iterable[str]) -> list[str]:
    return [node for node in nodes if not node.startswith(GATEWAY_PREFIX)]
