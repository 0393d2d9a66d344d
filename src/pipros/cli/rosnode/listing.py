"""`rosnode list`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.cli.program import Surroundings, option_parser
from pipros.errors import Refused
from pipros.graph.picture import Picture, is_below
from pipros.net.master import MasterClient

UNKNOWN_API = "unknown address"


def list_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "list")
    parser.add_option("-u", dest="uris", action="store_true", help="list XML-RPC URIs")
    parser.add_option("-a", "--all", dest="all", action="store_true", help="list all information")
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("invalid args: you may only specify one namespace")
    with Surroundings("rosnode") as here:
        ns = here.resolve(arguments[0]) if arguments else "/"
        print("\n".join(describe(here.master, ns, uris=options.uris, both=options.all)))
    return 0


def describe(master: MasterClient, ns: str, *, uris: bool = False, both: bool = False) -> list[str]:
    """A line for each node in a namespace: its name, its URI, or both."""
    nodes = node_names(master, ns)
    if both:
        return [f"{api_of(master, node)} \t{node}" for node in nodes]
    return [api_of(master, node) for node in nodes] if uris else nodes


def node_names(master: MasterClient, ns: str = "/") -> list[str]:
    """The nodes in a namespace, sorted."""
    picture = Picture.from_state(master.get_system_state())
    return [node for node in picture.nodes() if is_below(node, ns)]


def api_of(master: MasterClient, node: str) -> str:
    """The URI of a node's slave API, or words that say that the master does not know it any more."""
    try:
        return master.lookup_node(node)
    except Refused:
        return UNKNOWN_API
