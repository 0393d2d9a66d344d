"""Complete names in the running system: topics, nodes, services and parameters.

Only legal graph names are offered, because arbitrary text from peers must not reach a command line.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.graph_variables import master_uri_of

_TIMEOUT_S = 0.5

MANY_LINES = "\x1f"
"""Character before a multi-line candidate, which is offered alone."""


def live_names(command: str, before: Sequence[str]) -> list[str]:
    """Return names from the running system, or an empty list if no master responds within half a second."""
    return [name for name in _registered(command, before) if names.is_legal(name)]


def _registered(command: str, before: Sequence[str]) -> list[str]:
    from pipros.net.master_client import MasterClient
    from pipros_tools.graph.system_state import SystemState

    if len(before) > 1 and command != "rosnode":
        return []
    client = MasterClient(master_uri_of(os.environ), "/complete", timeout_s=_TIMEOUT_S)
    try:
        if command == "rosparam":
            return client.get_param_names()
        if command == "rostopic":
            return sorted(name for name, _ in client.get_topic_types())
        if command == "rosconsole" and before[0] == "echo":
            return []
        if command in ("rosservice", "rosnode", "rosconsole"):
            state = SystemState.from_state(client.get_system_state())
            return sorted(state.services) if command == "rosservice" else state.nodes()
    except PiprosError:
        pass
    finally:
        client.close()
    return []


def service_type(service: str) -> str:
    """Return the type of a running service, or an empty string if it is unknown."""
    from pipros_tools.graph.client import GraphClient
    from pipros_tools.graph.services import type_of

    try:
        with GraphClient("rosservice") as graph:
            type_name = type_of(graph.master, graph.resolve(service)) or ""
    except PiprosError:
        return ""
    return type_name if names.is_legal(type_name) else ""


def prototype(kind: str, type_name: str) -> list[str]:
    """Return a message or request template with default values, or an empty list if the type is unknown."""
    from pipros_tools.cli.rosmsg_proto import NoPrototype, example
    from pipros_tools.graph.skeleton import skeleton

    try:
        return [f'{MANY_LINES}"{skeleton(example(kind, type_name))}"'] if type_name else []
    except NoPrototype:
        return []
