"""`rosnode` for Python code: which nodes run, whether they answer, how to end them.

Facade of `pipros.graph`; see http://wiki.ros.org/rosnode.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Collection, Iterator, Sequence
from typing import Any

from pipros import names as _names
from pipros.cli.rosnode import main as _main
from pipros.errors import Refused
from pipros.graph import node_info as _node_info
from pipros.graph import nodes as _nodes
from pipros.graph import ping as _pinging
from pipros.graph.cleanup import clean_up as _clean_up
from pipros.graph.client import GraphClient
from pipros.graph.errors import translated
from pipros.lazy_names import star_names as _star_names

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

_star_names(
    __name__,
    "errno optparse:OptionParser os re rosgraph rostopic xmlrpc.client:ServerProxy socket sys time "
    "urlparse=urllib.parse",
)

NAME = "rosnode"
ID = "/rosnode"
CONNECTION_PATTERN = re.compile(r"\w+ connection on port (\d+) to \[(.*) on socket (\d+)\]")


class ROSNodeException(Exception):
    """A rosnode function failed."""


class ROSNodeIOException(ROSNodeException):
    """The master, or a node, does not answer."""


def _succeed(args: tuple[int, str, Any]) -> Any:
    """Return the value of a reply of the master or slave API. Other packages call it.

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
    """The nodes that run, in a namespace if one is given. Raises ROSNodeIOException without a master."""
    with _graph() as graph:
        return _nodes.node_names(graph.master, _names.resolve(namespace or "/", "/rosnode"))


def get_api_uri(master: object, caller_id: str, skip_cache: bool = False) -> str | None:  # noqa: ARG001
    """The URI of a node's slave API, None when it is unknown. The master is that of the environment."""
    with _graph() as graph:
        try:
            return graph.master.lookup_node(caller_id)
        except Refused:
            return None


def get_machines_by_nodes() -> list[str]:
    """The hosts that nodes run on."""
    with _graph() as graph:
        return _nodes.machines(graph.master)


def get_nodes_by_machine(machine: str) -> list[str]:
    """The nodes on a host."""
    with _graph() as graph:
        return _nodes.nodes_on(graph.master, machine)


def kill_nodes(node_names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Asks nodes to end. Returns those that do, and those that are not known or refuse."""
    with _graph() as graph:
        killed, failed = _nodes.kill(graph.master, node_names)
    return killed, list(failed)


def rosnode_ping(
    node_name: str,
    max_count: int | None = None,
    verbose: bool = False,
    skip_cache: bool = False,  # noqa: ARG001
) -> bool:
    """Pings a node `max_count` times, or for ever; False when it does not answer."""
    with _graph() as graph:
        return _pinging.ping(graph.master, node_name, count=max_count, say=print if verbose else None)


def rosnode_ping_all(verbose: bool = False, skip_cache: bool = False) -> tuple[list[str], list[str]]:  # noqa: ARG001
    """Pings every node once. Returns those that answered, and those that did not."""
    with _graph() as graph:
        return _pinging.ping_all(graph.master, print if verbose else None)


def rosnode_listnodes(namespace: str | None = None, list_uri: bool = False, list_all: bool = False) -> None:
    """Prints the nodes, their URIs, or both."""
    with _graph() as graph:
        ns = _names.resolve(namespace or "/", "/rosnode")
        print("\n".join(_nodes.listing(graph.master, ns, uris=list_uri, both=list_all)))


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Prints all about a node."""
    with _graph() as graph:
        _node_info.report_node(graph.master, graph.resolve(node_name), quiet=quiet)


def get_node_info_description(node_name: str) -> str:
    """What the master knows of a node, as text."""
    with _graph() as graph:
        return _node_info.describe_registrations(graph.master, node_name)


def get_node_connection_info_description(node_api: str, master: object) -> str:  # noqa: ARG001
    """What a node says of itself, as text. The master is that of the environment."""
    with _graph() as graph:
        return _node_info.describe_connections(graph.master, node_api)


def rosnode_debugnode(node_name: str, quiet: bool = False) -> None:
    """The same as `rosnode_info`."""
    rosnode_info(node_name, quiet)


def cleanup_master_blacklist(master: object, blacklist: Collection[str]) -> None:  # noqa: ARG001
    """Removes the registrations of these nodes from the master. The master is that of the environment."""
    with _graph() as graph:
        for node in _nodes.node_names(graph.master):
            if node in blacklist:
                _nodes.unregister(graph.master, node)


def cleanup_master_whitelist(master: object, whitelist: Collection[str]) -> None:  # noqa: ARG001
    """Removes the registrations of all other nodes from the master. The master is that of the environment."""
    with _graph() as graph:
        for node in _nodes.node_names(graph.master):
            if node not in whitelist:
                _nodes.unregister(graph.master, node)


def lookup_uri(master: Any, system_state: Sequence[Sequence[Any]], topic: str, uri: str) -> str:
    """The name of the node of that URI among the publishers and subscribers of a topic; else the URI.

    Args:
        master: a `rosgraph.Master`.
        system_state: what its `getSystemState` returns.
    """
    for kind in system_state[:2]:
        for name, nodes in kind:
            if name == topic:
                for node in nodes:
                    with contextlib.suppress(Exception):  # an unknown node, or a master that has ended
                        if master.lookupNode(node) == uri:
                            return str(node)
    return uri


def rosnode_cleanup() -> None:
    """Unregisters nodes that do not answer from the master, after asking on standard input."""
    with _graph() as graph:
        _clean_up(graph.master)


def rosnodemain(argv: Sequence[str] | None = None) -> None:
    """The command `rosnode`. The first argument is the name of the program.

    Raises:
        SystemExit: it failed, or was used wrongly.
    """
    if code := _main(None if argv is None else argv[1:]):
        sys.exit(code)
