"""The local master's topics and services that a member shares or accepts, according to its fleet file."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Sequence
from dataclasses import dataclass

from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.keys import AGENT_PREFIX
from pipros_tools.graph.definitions import Definition
from pipros_tools.graph.system_state import Registrations, SystemState

TopicDefinition = Callable[[str, str, Sequence[str]], Definition | None]
"""Function that takes a topic's name, type and nodes, and returns its definition; None if it is unknown."""
ServiceHeader = Callable[[str, Sequence[str]], tuple[str, str] | None]
"""Function that takes a service's name and providers, and returns its type and MD5 sum; None if no provider
answers.
"""


@dataclass(frozen=True, slots=True)
class LocalGraph:
    """Snapshot of the master's topics and services.

    Attributes:
        state: the registrations.
        shared: published topics that other members can receive.
        accepted: subscribed topics to which other members can publish.
        services: services that other members can call.
    """

    state: SystemState
    shared: tuple[DirectoryEntry, ...] = ()
    accepted: tuple[DirectoryEntry, ...] = ()
    services: tuple[DirectoryEntry, ...] = ()


def is_agent(node: str) -> bool:
    """Return whether a node is an agent. A topic that only agents use is never offered."""
    return node.startswith(AGENT_PREFIX)


def not_agents(nodes: Iterable[str]) -> list[str]:
    return [node for node in nodes if not is_agent(node)]


def is_returned(name: str, member: str, others: Iterable[str], local: Container[str]) -> bool:
    """Return whether a name on a member's master may be one that the fleet created on another master.

    A relay between masters, such as a gateway to ROS 2 on each of them, returns such names. If they were
    shared again, they would become longer each time.

    Args:
        others: names of other members.
        local: the names on the member's master. On `robot1`'s master, `/robot1/x` counts as returned only
            if `/x` exists too or is itself in a member's namespace.

    >>> is_returned("/b/x", "b", ["a"], {"/x", "/b/x"}), is_returned("/b/x", "b", ["a"], {"/b/x"})
    (True, False)
    >>> is_returned("/a/x", "b", ["a"], {"/a/x"}), is_returned("/b/a/x", "b", ["a"], {"/b/a/x"})
    (True, True)
    """
    foreign, own = tuple(f"/{each}/" for each in others), f"/{member}/"
    if name.startswith(foreign) or not name.startswith(own):
        return name.startswith(foreign)
    rest = name.removeprefix(f"/{member}")
    return rest in local or rest.startswith((own, *foreign))


def graph_of(
    state: SystemState,
    types: dict[str, str],
    file: FleetFile,
    member: str,
    others: Iterable[str],
    define: TopicDefinition,
    header: ServiceHeader,
) -> LocalGraph:
    """Return the topics and services that a member offers. `define` and `header` may block.

    Args:
        types: the type of each topic.
        member: name of this member.
        others: names of other members; names in their namespaces are omitted.
    """
    members, topics = tuple(others), set(state.topics())

    def entries(
        nodes_by_topic: Registrations, is_offered: Callable[[str], object]
    ) -> tuple[DirectoryEntry, ...]:
        found = []
        for topic, nodes in nodes_by_topic.items():
            local = not_agents(nodes)
            if not local or is_returned(topic, member, members, topics) or not is_offered(topic):
                continue
            kind = types.get(topic, "*")
            definition = define(topic, kind, local) if "/" in kind else None
            if definition is not None:
                found.append(DirectoryEntry(topic, definition.type, definition.md5sum))
        return tuple(sorted(found))

    services = []
    for name, nodes in state.services.items():
        rule = file.accepted_service(name)
        local = not_agents(nodes)
        if rule is None or not local or is_returned(name, member, members, state.services):
            continue
        if found := header(name, local):
            services.append(DirectoryEntry(name, *found, timeout_s=rule.timeout_s))
    return LocalGraph(
        state,
        entries(state.publishers, file.shared_topic),
        entries(state.subscribers, file.accepted_topic),
        tuple(sorted(services)),
    )


def outcome_topics(entry: DirectoryEntry) -> tuple[str, ...]:
    """Return an action's feedback and result topics if `entry` is its status topic, otherwise an empty tuple.

    An action client sends its goal as soon as it has received a status message, so the agent on the client's
    side must already be subscribed to the feedback and result topics.
    """
    action, _, last = entry.name.rpartition("/")
    is_status = entry.type == "actionlib_msgs/GoalStatusArray" and last == "status"
    return (f"{action}/feedback", f"{action}/result") if is_status else ()


def is_result(entry: DirectoryEntry) -> bool:
    """Return whether an entry is an action's result topic."""
    return entry.name.endswith("/result") and entry.type.endswith("ActionResult")


def occupied(state: SystemState, member: str) -> str | None:
    """Return a local node or service in a member's namespace, or None if there is none.

    Topics are allowed: local nodes use topics in this namespace to communicate with the member.
    """
    prefix = f"/{member}/"
    for node in sorted(state.nodes()):
        if node.startswith(prefix) and not is_agent(node):
            return node
    for service, nodes in state.services.items():
        if service.startswith(prefix) and not_agents(nodes):
            return service
    return None
