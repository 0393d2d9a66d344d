"""The nodes in a running system: lists, machines, shutdown and unregistration."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from pipros.basics.errors import PiprosError, Refused
from pipros.basics.printable import listed, printable
from pipros.net.identify import identification, value_of
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.wire.xmlrpc import Fault
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.system_state import SystemState, is_below, of_node

UNKNOWN_API = "unknown address"

SHUTDOWN_DEADLINE_S = 5.0
"""Timeout for a node's response to a shutdown request."""


def node_names(master: MasterClient, ns: str = "/") -> list[str]:
    """Return the nodes in a namespace, sorted."""
    state = SystemState.from_state(master.get_system_state())
    return [node for node in state.nodes() if is_below(node, ns)]


def api_of(master: MasterClient, node: str) -> str:
    """Return the URI of a node's slave API, or `unknown address` if the node is not registered."""
    try:
        return master.lookup_node(node)
    except Refused:
        return UNKNOWN_API


def listing(master: MasterClient, ns: str, *, uris: bool = False, both: bool = False) -> list[str]:
    """Return a line for each node in a namespace: its name, its URI, or both."""
    nodes = node_names(master, ns)
    if both:
        return [f"{listed(api_of(master, node))} \t{listed(node)}" for node in nodes]
    return [listed(api_of(master, node) if uris else node) for node in nodes]


def machines(master: MasterClient) -> list[str]:
    """Return the host names that nodes have registered, sorted."""
    return sorted(set(_hosts(master).values()))


def nodes_on(master: MasterClient, machine: str) -> list[str]:
    """Return the nodes on a machine, including those registered under another of its names or addresses.

    Raises:
        GraphError: the machine's name does not resolve to an address.
    """
    addresses = _addresses(machine)
    if not addresses:
        raise GraphError(f"cannot resolve machine name [{machine}] to address")
    return [node for node, host in _hosts(master).items() if host == machine or addresses & _addresses(host)]


def _hosts(master: MasterClient) -> dict[str, str]:
    """Return the host of each node whose address is known, sorted by node."""
    from pipros.net.address import split_uri

    hosts = {}
    for node in node_names(master):
        try:
            hosts[node] = split_uri(api_of(master, node))[0]
        except ValueError:  # the node has unregistered in the meantime, or its address is invalid
            continue
    return hosts


def _addresses(host: str) -> set[object]:
    from pipros.net.lookup import process_lookups

    try:
        return {info[4][0] for info in process_lookups().find(host, None)}
    except OSError:
        return set()


def kill(master: MasterClient, nodes: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Ask nodes to shut down. Return the nodes that accepted, and the reason for each failure.

    A node that does not answer counts as shut down.
    """
    killed, failed = [], {}
    for node in nodes:
        try:
            api = master.lookup_node(node)
        except Refused as error:
            failed[node] = error.text
            continue
        answer: object = None
        with (
            contextlib.suppress(PiprosError, ValueError),
            RpcClient(api, timeout_s=SHUTDOWN_DEADLINE_S) as client,
        ):
            if not _is_node(client, node, master.caller_id):
                failed[node] = f"the server at {printable(api)} is not this node, and is left alone"
                continue
            answer = client.call("shutdown", master.caller_id, "user request")
        if isinstance(answer, list) and len(answer) == 3 and answer[0] != 1:
            failed[node] = f"{printable(api)} refuses: {printable(answer[1])}"
        else:
            killed.append(node)
    return killed, failed


def _is_node(client: RpcClient, node: str, caller_id: str) -> bool:
    """Return whether the server is the node. Raises PiprosError if it does not respond."""
    queries = identification(node)
    method = next(queries)
    while True:
        try:
            answer = client.call(method, caller_id)
        except Fault:
            answer = None
        try:
            method = queries.send(value_of(answer))
        except StopIteration as end:
            return bool(end.value)


def unregister(master: MasterClient, node: str) -> None:
    """Unregister all topics and services of a node, by calling the master on the node's behalf."""
    state = SystemState.from_state(master.get_system_state())
    try:
        api = master.lookup_node(node)
    except Refused:  # the node has unregistered in the meantime
        return
    itself = MasterClient(master.uri, node)
    try:
        for topic in of_node(node, state.publishers):
            itself.unregister_publisher(topic, api)
        for topic in of_node(node, state.subscribers):
            itself.unregister_subscriber(topic, api)
        for service in of_node(node, state.services):
            with contextlib.suppress(Refused):  # the service has been unregistered in the meantime
                itself.unregister_service(service, itself.lookup_service(service))
    finally:
        itself.close()
