"""`rosnode` for Python code: which nodes run, whether they answer, how to end them.

Facade of `pipros.cli.rosnode`; see http://wiki.ros.org/rosnode.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence

from pipros import names as _names
from pipros.cli.program import NO_MASTER, CommandError, Surroundings
from pipros.cli.rosnode import cleanup as _cleanup
from pipros.cli.rosnode import info as _info
from pipros.cli.rosnode import kill as _kill
from pipros.cli.rosnode import listing as _listing
from pipros.cli.rosnode import machine as _machine
from pipros.cli.rosnode import main as _main
from pipros.cli.rosnode import ping as _ping
from pipros.errors import Refused, Unreachable

__all__ = [
    "ROSNodeException",
    "ROSNodeIOException",
    "get_api_uri",
    "get_machines_by_nodes",
    "get_node_connection_info_description",
    "get_node_info_description",
    "get_node_names",
    "get_nodes_by_machine",
    "kill_nodes",
    "rosnode_cleanup",
    "rosnode_info",
    "rosnode_listnodes",
    "rosnode_ping",
    "rosnode_ping_all",
    "rosnodemain",
]


class ROSNodeException(Exception):
    """A rosnode function failed."""


class ROSNodeIOException(ROSNodeException):
    """The master, or a node, does not answer."""


@contextlib.contextmanager
def _surroundings() -> Iterator[Surroundings]:
    try:
        with Surroundings("rosnode") as here:
            yield here
    except Unreachable:
        raise ROSNodeIOException(NO_MASTER) from None
    except CommandError as error:
        raise ROSNodeIOException(str(error)) from None


def get_node_names(namespace: str | None = None) -> list[str]:
    """The nodes that run, in a namespace if one is given. Raises ROSNodeIOException without a master."""
    with _surroundings() as here:
        return _listing.node_names(here.master, _names.resolve(namespace or "/", "/rosnode"))


def get_api_uri(master: object, caller_id: str, skip_cache: bool = False) -> str | None:  # noqa: ARG001
    """The URI of a node's slave API, None when it is unknown. The master is that of the environment."""
    with _surroundings() as here:
        try:
            return here.master.lookup_node(caller_id)
        except Refused:
            return None


def get_machines_by_nodes() -> list[str]:
    """The hosts that nodes run on."""
    with _surroundings() as here:
        return _machine.machines(here.master)


def get_nodes_by_machine(machine: str) -> list[str]:
    """The nodes on a host."""
    with _surroundings() as here:
        return _machine.nodes_on(here.master, machine)


def kill_nodes(node_names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Asks nodes to end. Returns those that were asked, and those that could not be."""
    with _surroundings() as here:
        return _kill.kill(here.master, node_names)


def rosnode_ping(
    node_name: str,
    max_count: int | None = None,
    verbose: bool = False,
    skip_cache: bool = False,  # noqa: ARG001
) -> bool:
    """Pings a node `max_count` times, or for ever; False when it does not answer."""
    with _surroundings() as here:
        return _ping.ping(here.master, node_name, count=max_count, say=print if verbose else None)


def rosnode_ping_all(verbose: bool = False, skip_cache: bool = False) -> tuple[list[str], list[str]]:  # noqa: ARG001
    """Pings every node once. Returns those that answered, and those that did not."""
    with _surroundings() as here:
        return _ping.ping_all(here.master, print if verbose else None)


def rosnode_listnodes(namespace: str | None = None, list_uri: bool = False, list_all: bool = False) -> None:
    """Prints the nodes, their URIs, or both."""
    with _surroundings() as here:
        ns = _names.resolve(namespace or "/", "/rosnode")
        print("\n".join(_listing.describe(here.master, ns, uris=list_uri, both=list_all)))


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Prints all about a node."""
    with _surroundings() as here:
        _info.print_node(here.master, here.resolve(node_name), quiet=quiet)


def get_node_info_description(node_name: str) -> str:
    """What the master knows of a node, as text."""
    with _surroundings() as here:
        return _info.describe_registrations(here.master, node_name)


def get_node_connection_info_description(node_api: str, master: object) -> str:  # noqa: ARG001
    """What a node says of itself, as text. The master is that of the environment."""
    with _surroundings() as here:
        return _info.describe_connections(here.master, node_api)


def rosnode_cleanup() -> None:
    """Takes nodes that do not answer off the master's books, once a person has agreed."""
    with _surroundings():
        _cleanup.clean_up([])


def rosnodemain(argv: Sequence[str] | None = None) -> None:
    """The command `rosnode`; ends the process. The first argument is the name of the program."""
    sys.exit(_main(None if argv is None else argv[1:]))
