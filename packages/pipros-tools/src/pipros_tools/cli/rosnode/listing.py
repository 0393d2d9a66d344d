"""`rosnode list`: lists nodes."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli.runner import add_flag, option_parser
from pipros_tools.cli.terminal import DIM, aligned, is_terminal
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.nodes import listing


def list_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "list")
    add_flag(parser, "-u", dest="uris", help="list XML-RPC URIs")
    add_flag(parser, "-a", "--all", help="list all information")
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("invalid args: you may only specify one namespace")
    with GraphClient("rosnode") as graph:
        ns = graph.resolve(arguments[0]) if arguments else "/"
        lines = listing(graph.master, ns, uris=options.uris, both=options.all)
    if options.all and is_terminal():
        lines = aligned([line.split(" \t") for line in lines], (DIM, ""))
    print("\n".join(lines))
    return 0
