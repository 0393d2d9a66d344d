"""What a member offers to others: the topics and services of its master that its file shares or accepts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from pipros.basics.errors import PiprosError
from pipros.bridges.foxglove.catalog import Definition
from pipros.fleet.directory import Entry
from pipros.fleet.fleet_file import FleetFile
from pipros.graph.system_state import FLEET_AGENT_PREFIX, Registrations, SystemState

TopicDefinition = Callable[[str, str, Sequence[str]], Definition | None]
"""Return the definition of a topic with this type and these nodes; None if it cannot be found out."""
ServiceHeader = Callable[[str, Sequence[str]], tuple[str, str] | None]
"""Return the type and md5 sum of a service with these providers; None if it does not answer."""


@dataclass(frozen=True, slots=True)
class LocalGraph:
    """One look at the master.

    Attributes:
        state: the registrations.
        shared: topics that other members can receive, with a publisher.
        accepted: topics that other members can publish, with a subscriber.
        services: services that they can call.
    """

    state: SystemState
    shared: tuple[Entry, ...] = ()
    accepted: tuple[Entry, ...] = ()
    services: tuple[Entry, ...] = ()


class LocalMaster(Protocol):
    """Calls to the master, implemented by `pipros.net.master_client.MasterClient`."""

    def get_system_state(self) -> list[list[list[object]]]: ...
    def get_topic_types(self) -> list[list[str]]: ...


def is_agent(node: str) -> bool:
    """Return whether a node is an agent. Topics of agents alone are never offered."""
    return node.startswith(FLEET_AGENT_PREFIX)


def not_agents(nodes: Iterable[str]) -> list[str]:
    return [node for node in nodes if not is_agent(node)]


def look(
    state: SystemState,
    types: dict[str, str],
    file: FleetFile,
    others: Iterable[str],
    define: TopicDefinition,
    header: ServiceHeader,
) -> LocalGraph:
    """Return what a member offers. Calls of `define` and `header` may block.

    Args:
        types: the type of each topic.
        others: names of other members, whose namespaces belong to them.
    """
    foreign = tuple(f"/{name}/" for name in others)

    def entries(nodes_by_topic: Registrations, is_offered: Callable[[str], object]) -> tuple[Entry, ...]:
        found = []
        for topic, nodes in nodes_by_topic.items():
            local = not_agents(nodes)
            if not local or topic.startswith(foreign) or not is_offered(topic):
                continue
            kind = types.get(topic, "*")
            definition = define(topic, kind, local) if "/" in kind else None
            if definition is not None:
                found.append(Entry(topic, definition.type, definition.md5sum))
        return tuple(sorted(found))

    services = []
    for name, nodes in state.services.items():
        rule = file.accepted_service(name)
        local = not_agents(nodes)
        if rule is not None and local and not name.startswith(foreign) and (found := header(name, local)):
            services.append(Entry(name, *found, timeout_s=rule.timeout_s))
    return LocalGraph(
        state,
        entries(state.publishers, file.shared_topic),
        entries(state.subscribers, file.accepted_topic),
        tuple(sorted(services)),
    )


def outcome_topics(entry: Entry) -> tuple[str, ...]:
    """Return the topics for the feedback and the results of the action whose status a topic gives; else none.

    A client takes the status for the sign that it may send a goal, so the outcome must be received before.
    """
    action, _, last = entry.name.rpartition("/")
    is_status = entry.type == "actionlib_msgs/GoalStatusArray" and last == "status"
    return (f"{action}/feedback", f"{action}/result") if is_status else ()


def occupied(state: SystemState, member: str) -> str | None:
    """Return a local node or service that uses the namespace of a member; None if it is free.

    Local nodes may publish and subscribe to topics there, because that is how a member is used.
    """
    prefix = f"/{member}/"
    for node in sorted(state.nodes()):
        if node.startswith(prefix) and not is_agent(node):
            return node
    for service, nodes in state.services.items():
        if service.startswith(prefix) and not_agents(nodes):
            return service
    return None


def read_state(master: LocalMaster) -> tuple[SystemState, dict[str, str]] | None:
    """Return the registrations and types of a master; None if it does not answer."""
    try:
        state = SystemState.from_state(master.get_system_state())
        return state, {topic: kind for topic, kind in master.get_topic_types()}  # noqa: C416
    except (PiprosError, ValueError):
        return None
