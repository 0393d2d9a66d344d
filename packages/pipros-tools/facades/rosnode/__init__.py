"""Python API of `rosnode`: list, ping and shut down nodes.

Unless stated otherwise, functions raise `ROSNodeIOException` if the master cannot be reached.
Facade of `pipros_tools.graph`; see http://wiki.ros.org/rosnode.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Collection, Iterator, Sequence
from typing import Any

from pipros.basics import names as _names
from pipros.basics.errors import Refused
from pipros_tools.cli.rosnode import main as _main
from pipros_tools.graph import node_info as _node_info
from pipros_tools.graph import nodes as _nodes
from pipros_tools.graph import ping as _pinging
from pipros_tools.graph.cleanup import clean_up as _clean_up
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import translated

__all__ = [
    "CONNECTION_PATTERN",
    "ID",
    "NAME",
    "ROSNodeException",
    "ROSNodeIOException",
    "cleanup_master_blacklist",
    "cleanup_master_whitelist",
    "get_api_uri",
    "get_machines_by_nodes",
    "get_node_connection_info_description",
    "get_node_info_description",
    "get_node_names",
    "get_nodes_by_machine",
    "kill_nodes",
    "lookup_uri",
    "rosnode_cleanup",
    "rosnode_debugnode",
    "rosnode_info",
    "rosnode_listnodes",
    "rosnode_ping",
    "rosnode_ping_all",
    "rosnodemain",
]

NAME = "rosnode"
ID = "/rosnode"
CONNECTION_PATTERN = re.compile(r"\w+ connection on port (\d+) to \[(.*) on socket (\d+)\]")


class ROSNodeException(Exception):
    """A rosnode function failed."""


class ROSNodeIOException(ROSNodeException):
    """The master or a node cannot be reached."""


def _succeed(args: tuple[int, str, Any]) -> Any:
    """Return the value in a reply from the master or slave API. Other packages call this function.

    Raises:
        ROSNodeException: the reply is an error.
    """
    code, message, value = args
    if code != 1:
        raise ROSNodeException(f"remote call failed: {message}")
    return value


@contextlib.contextmanager
def _graph() -> Iterator[GraphClient]:
    with translated(ROSNodeIOException, ROSNodeIOException), GraphClient("rosnode") as graph:
        yield graph


def get_node_names(namespace: str | None = None) -> list[str]:
    """Return the registered nodes, optionally only the nodes in one namespace.

    Raises:
        ROSNodeIOException: the master cannot be reached.
    """
    with _graph() as graph:
        return _nodes.node_names(graph.master, _names.resolve(namespace or "/", "/rosnode"))


def get_api_uri(master: object, caller_id: str, skip_cache: bool = False) -> str | None:  # noqa: ARG001
    """Return the URI of a node's slave API, or None for an unknown node. `master` is ignored."""
    with _graph() as graph:
        try:
            return graph.master.lookup_node(caller_id)
        except Refused:
            return None


def get_machines_by_nodes() -> list[str]:
    """Return the hosts on which nodes run."""
    with _graph() as graph:
        return _nodes.machines(graph.master)


def get_nodes_by_machine(machine: str) -> list[str]:
    """Return the nodes on a host."""
    with _graph() as graph:
        return _nodes.nodes_on(graph.master, machine)


def kill_nodes(node_names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Ask nodes to shut down.

    Returns:
        The nodes that accepted or did not respond, and the nodes that are unknown or refused.
    """
    with _graph() as graph:
        killed, failed = _nodes.kill(graph.master, node_names)
    return killed, list(failed)


def rosnode_ping(
    node_name: str,
    max_count: int | None = None,
    verbose: bool = False,
    skip_cache: bool = False,  # noqa: ARG001
) -> bool:
    """Ping a node once per second, `max_count` times (None or 0: endlessly). Return False if a ping fails."""
    with _graph() as graph:
        return _pinging.ping(graph.master, node_name, count=max_count, say=print if verbose else None)


def rosnode_ping_all(verbose: bool = False, skip_cache: bool = False) -> tuple[list[str], list[str]]:  # noqa: ARG001
    """Ping every node once. Return the responsive and the unresponsive nodes."""
    with _graph() as graph:
        return _pinging.ping_all(graph.master, print if verbose else None)


def rosnode_listnodes(namespace: str | None = None, list_uri: bool = False, list_all: bool = False) -> None:
    """Print the nodes, their URIs, or both."""
    with _graph() as graph:
        ns = _names.resolve(namespace or "/", "/rosnode")
        print("\n".join(_nodes.listing(graph.master, ns, uris=list_uri, both=list_all)))


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Print the publications, subscriptions, services and connections of a node."""
    with _graph() as graph:
        _node_info.report_node(graph.master, graph.resolve(node_name), quiet=quiet)


def get_node_info_description(node_name: str) -> str:
    """Return a description of a node's registrations with the master."""
    with _graph() as graph:
        return _node_info.describe_registrations(graph.master, node_name)


def get_node_connection_info_description(node_api: str, master: object) -> str:  # noqa: ARG001
    """Return a description of the connections that a node reports. `master` is ignored."""
    with _graph() as graph:
        return _node_info.describe_connections(graph.master, node_api)


def rosnode_debugnode(node_name: str, quiet: bool = False) -> None:
    """Same as `rosnode_info`."""
    rosnode_info(node_name, quiet)


def cleanup_master_blacklist(master: object, blacklist: Collection[str]) -> None:  # noqa: ARG001
    """Remove the registrations of the nodes in `blacklist` from the master. `master` is ignored."""
    with _graph() as graph:
        for node in _nodes.node_names(graph.master):
            if node in blacklist:
                _nodes.unregister(graph.master, node)


def cleanup_master_whitelist(master: object, whitelist: Collection[str]) -> None:  # noqa: ARG001
    """Remove the registrations of all nodes not in `whitelist` from the master. `master` is ignored."""
    with _graph() as graph:
        for node in _nodes.node_names(graph.master):
            if node not in whitelist:
                _nodes.unregister(graph.master, node)


def lookup_uri(master: Any, system_state: Sequence[Sequence[Any]], topic: str, uri: str) -> str:
    """Return the publisher or subscriber of `topic` whose slave API is at `uri`.

    Return `uri` if there is none.

    Args:
        master: a `rosgraph.Master`.
        system_state: the result of its `getSystemState`.
    """
    for kind in system_state[:2]:
        for name, nodes in kind:
            if name == topic:
                for node in nodes:
                    # the node may be unknown, or the master unreachable
                    with contextlib.suppress(Exception):
                        if master.lookupNode(node) == uri:
                            return str(node)
    return uri


def rosnode_cleanup() -> None:
    """Unregister unresponsive nodes from the master, after confirmation on standard input."""
    with _graph() as graph:
        _clean_up(graph.master)


def rosnodemain(argv: Sequence[str] | None = None) -> None:
    """Run the command `rosnode`. `argv` starts with the program's name.

    Raises:
        SystemExit: the command failed, or its arguments are invalid.
    """
    if code := _main(None if argv is None else argv[1:]):
        sys.exit(code)
