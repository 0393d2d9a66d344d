"""`rosnode info`."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from pipros.cli.program import CommandError, Surroundings, bullets, option_parser
from pipros.cli.rosnode.listing import api_of
from pipros.errors import Refused, Unreachable
from pipros.graph.picture import Picture, of_node
from pipros.net.master import MasterClient
from pipros.net.rpc import RpcClient

RULE = "-" * 80
ANSWER_DEADLINE_S = 10.0
"""How long a node may take to tell about itself; one that hangs must not hang the command as well."""

_SOCKET = re.compile(r"on port (?P<port>\d+) to \[(?P<peer>.+:\d+) on socket (?P<socket>\d+)\]")
_DIRECTIONS = {"i": "inbound", "o": "outbound"}


def show_info(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "info [options] node1 [node2...]")
    parser.add_option(
        "-q",
        "--quiet",
        dest="quiet",
        action="store_true",
        help="Prints only basic information such as pubs/subs and does not contact nodes"
        " for more information",
    )
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must specify at least one node name")
    with Surroundings("rosnode") as here:
        for name in arguments:
            print_node(here.master, here.resolve(name), quiet=options.quiet)
    return 0


def print_node(master: MasterClient, node: str, *, quiet: bool = False) -> None:
    """Prints all about a node; what the master knows comes first, so that it is there when the node is not.

    Raises:
        CommandError: the node does not answer.
    """
    print(RULE)
    print(describe_registrations(master, node))
    try:
        api = master.lookup_node(node)
    except Refused:
        print(f"cannot contact [{node}]: unknown node", file=sys.stderr)
        return
    if not quiet:
        print(f"\ncontacting node {api} ...", flush=True)
        print(describe_connections(master, api))


def describe_registrations(master: MasterClient, node: str) -> str:
    """What the master knows of a node."""
    picture = Picture.from_state(master.get_system_state())
    # Noetic takes the types of what is published now, so a topic without a publisher is of unknown type.
    types: Mapping[str, str] = dict(master.get_published_topics())
    lines = [f"Node [{node}]"]
    for heading, topics in (("Publications", picture.publishers), ("Subscriptions", picture.subscribers)):
        own = of_node(node, topics)
        lines += _section(heading, [f"{topic} [{types.get(topic, 'unknown type')}]" for topic in own])
    lines += _section("Services", of_node(node, picture.services))
    return "\n".join(lines)


def _section(heading: str, entries: Sequence[str]) -> list[str]:
    if not entries:
        return [f"{heading}: None", ""]
    return [bullets(f"{heading}: ", entries), ""]


def describe_connections(master: MasterClient, api: str) -> str:
    """What a node says of itself: its process and its connections.

    Raises:
        CommandError: it does not answer.
    """
    try:
        with RpcClient(api, timeout_s=ANSWER_DEADLINE_S) as node:
            pid = _value(node.call("getPid", master.caller_id))
            connections = _value(node.call("getBusInfo", master.caller_id))
    except (Unreachable, ValueError):
        raise CommandError(f"Communication with node[{api}] failed!") from None
    lines = [f"Pid: {pid}"]
    if connections:
        lines.append("Connections:")
        peers = _Peers(master)
        for connection in connections:
            lines += _describe_connection(connection, peers)
    return "\n".join(lines) + "\n"


def _value(answer: Any) -> Any:
    code, text, value = answer
    if code != 1:
        raise CommandError(f"remote call failed: {text}")
    return value


def _describe_connection(connection: Sequence[Any], peers: _Peers) -> list[str]:
    """The lines for one entry of `getBusInfo`, none for a connection that is not up.

    An entry is (id, destination, direction, transport, topic[, is connected[, remark]]); old
    clients leave the end out. The destination is a node's name or the URI of its API.
    """
    if len(connection) < 5:
        return []
    _, destination, direction, transport, topic, *state = connection
    if state and not state[0]:
        return []
    heading = _DIRECTIONS.get(direction, "unknown")
    if remark := _SOCKET.search(str(state[1])) if len(state) > 1 else None:
        heading += f" ({remark['port']} - {remark['peer']}) [{remark['socket']}]"
    return [
        f" * topic: {topic}",
        f"    * to: {peers.describe(destination, topic)}",
        f"    * direction: {heading}",
        f"    * transport: {transport}",
    ]


class _Peers:
    """Finds the names of the nodes that connections lead to, asking the master as little as possible."""

    def __init__(self, master: MasterClient) -> None:
        self._master = master
        self._publishers = Picture.from_state(master.get_system_state()).publishers
        self._apis: dict[str, str] = {}

    def describe(self, destination: str, topic: str) -> str:
        """The destination; with its name in front when it is the URI of one of the topic's publishers."""
        if not destination.startswith("http://"):
            return destination
        for node in self._publishers.get(topic, ()):
            if node not in self._apis:
                self._apis[node] = api_of(self._master, node)
            if self._apis[node] == destination:
                return f"{node} ({destination})"
        return destination
