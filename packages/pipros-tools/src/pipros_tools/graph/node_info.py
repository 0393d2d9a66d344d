"""The text that `rosnode info` prints: a node's registrations, and the connections that it reports."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError, Refused
from pipros.basics.printable import listed, printable
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros_tools.graph.bus_info import BusConnection, established
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.nodes import api_of
from pipros_tools.graph.output import bullets, to_stderr, to_stdout
from pipros_tools.graph.system_state import SystemState, of_node

if TYPE_CHECKING:
    from pipros.basics.printable import Say

RULE = "-" * 80
ANSWER_DEADLINE_S = 10.0
"""Timeout for a node's response, so that an unresponsive node does not block the command."""

_SOCKET = re.compile(r"on port (?P<port>\d+) to \[(?P<peer>\S+:\d+) on socket (?P<socket>\d+)\]")
_DIRECTIONS = {"i": "inbound", "o": "outbound"}


def report_node(
    master: MasterClient, node: str, *, quiet: bool = False, say: Say = to_stdout, complain: Say = to_stderr
) -> None:
    """Print a node's registrations, then its connections, which the node itself reports.

    Raises:
        GraphError: the node does not answer.
    """
    say(RULE)
    say(describe_registrations(master, node))
    try:
        api = master.lookup_node(node)
    except Refused:
        complain(f"cannot contact [{node}]: unknown node")
        return
    if not quiet:
        say(f"\ncontacting node {listed(api)} ...")
        say(describe_connections(master, api))


def describe_registrations(master: MasterClient, node: str) -> str:
    """Describe a node's registrations."""
    state = SystemState.from_state(master.get_system_state())
    types = {topic: kind for topic, kind in master.get_topic_types() if kind != "*"}
    lines = [f"Node [{node}]"]
    for heading, topics in (("Publications", state.publishers), ("Subscriptions", state.subscribers)):
        node_topics = of_node(node, topics)
        lines += _section(heading, [f"{topic} [{types.get(topic, 'unknown type')}]" for topic in node_topics])
    lines += _section("Services", of_node(node, state.services))
    return "\n".join(lines)


def _section(heading: str, entries: Sequence[str]) -> list[str]:
    if not entries:
        return [f"{heading}: None", ""]
    return [bullets(f"{heading}: ", entries), ""]


def describe_connections(master: MasterClient, api: str) -> str:
    """Describe the process and the connections that a node reports.

    Raises:
        GraphError: the node does not answer.
    """
    try:
        with RpcClient(api, timeout_s=ANSWER_DEADLINE_S) as node:
            pid = _value(node.call("getPid", master.caller_id))
            connections = _value(node.call("getBusInfo", master.caller_id))
    except GraphError:
        raise
    except (PiprosError, ValueError, TypeError):
        # the node is unreachable, or its response is not [code, text, value]
        raise GraphError(f"Communication with node[{listed(api)}] failed!") from None
    lines = [f"Pid: {listed(pid)}"]
    if connections and isinstance(connections, list):
        lines.append("Connections:")
        peers = _Peers(master)
        for connection in established(connections):
            lines += _describe_connection(connection, peers)
    return "\n".join(lines) + "\n"


def _value(answer: Any) -> Any:
    code, text, value = answer
    if code != 1:
        raise GraphError(f"remote call failed: {printable(text)}")
    return value


def _describe_connection(connection: BusConnection, peers: _Peers) -> list[str]:
    heading = _DIRECTIONS.get(connection.direction, "unknown")
    if socket := _SOCKET.search(connection.remark):
        heading += f" ({socket['port']} - {socket['peer']}) [{socket['socket']}]"
    return [
        f" * topic: {listed(connection.topic)}",
        f"    * to: {listed(peers.describe(connection.peer, connection.topic))}",
        f"    * direction: {listed(heading)}",
        f"    * transport: {listed(connection.transport)}",
        *(
            f"    * {listed(part)}"
            for part in connection.remark.split(", ")
            if part.startswith("shared memory: ")
        ),
    ]


class _Peers:
    """Resolves the URIs of connections to node names, with few calls to the master."""

    def __init__(self, master: MasterClient) -> None:
        self._master = master
        self._publishers = SystemState.from_state(master.get_system_state()).publishers
        self._apis: dict[str, str] = {}

    def describe(self, destination: str, topic: str) -> str:
        """Return `NODE (URI)` if the destination is the URI of one of the topic's publishers.

        Otherwise, return the destination.
        """
        if not destination.startswith("http://"):
            return destination
        for node in self._publishers.get(topic, ()):
            if node not in self._apis:
                self._apis[node] = api_of(self._master, node)
            if self._apis[node] == destination:
                return f"{node} ({destination})"
        return destination
