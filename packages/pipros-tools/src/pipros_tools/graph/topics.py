"""The topics in a running system: their types, field types (`/scan/ranges`), publishers and subscribers."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.errors import NotFound, Refused
from pipros.basics.printable import listed
from pipros.net.master_client import MasterClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.system_state import SystemState


def topic_type(master: MasterClient, name: str) -> tuple[str | None, str]:
    """Return the type of the topic that `name` starts with, and the topic.

    `/scan/ranges` is the field `ranges` of `/scan`, unless a topic `/scan/ranges` exists. Return `(None,
    name)` if the topic is unknown or does not have a type yet.
    """
    types = {topic: type_name for topic, type_name in master.get_topic_types() if type_name != "*"}
    topic = name
    while topic:
        if topic in types:
            return types[topic], topic
        topic = topic.rpartition("/")[0]
    return None, name


def field_type(type_name: str, path: Sequence[str]) -> str:
    """Return the type of a message's field, which may be nested: `header/stamp` is `time`.

    Raises:
        NotFound: the field or the message type does not exist.
    """
    from pipros_tools.graph.message_path import field_types

    for name in path:
        fields = field_types(type_name)
        if name not in fields:
            raise NotFound(f"{type_name} has no field [{name}]")
        type_name = fields[name]
    return type_name


def topics_of_type(master: MasterClient, type_name: str) -> list[str]:
    """Return the topics whose message type is `type_name`, in the master's order."""
    return [topic for topic, found in master.get_topic_types() if found == type_name]


def describe_topic(master: MasterClient, topic: str) -> str:
    """Return the text that `rostopic info` prints.

    Raises:
        GraphError: the topic has neither publishers nor subscribers.
    """
    state = SystemState.from_state(master.get_system_state())
    if topic not in state.publishers and topic not in state.subscribers:
        raise GraphError(f"Unknown topic {topic}")
    types = dict(master.get_topic_types())
    lines = [f"Type: {listed(types.get(topic, 'unknown type'))}", ""]
    for heading, registrations in (("Publishers", state.publishers), ("Subscribers", state.subscribers)):
        nodes = registrations.get(topic)
        if nodes:
            lines.append(f"{heading}: ")
            lines += [f" * {listed(node)} ({listed(_api(master, node))})" for node in nodes]
        else:
            lines.append(f"{heading}: None")
        lines.append("")
    return "\n".join(lines) + "\n"


def _api(master: MasterClient, node: str) -> str:
    try:
        return master.lookup_node(node)
    except Refused:  # the node has unregistered in the meantime
        return "unknown"
