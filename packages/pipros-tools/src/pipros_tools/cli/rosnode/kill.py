"""`rosnode kill`: shuts nodes down."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.printable import listed
from pipros_tools.cli.runner import add_flag, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.nodes import kill, node_names
from pipros_tools.graph.output import bullets


def kill_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "kill [node]...")
    add_flag(parser, "-a", "--all", help="kill all nodes")
    options, arguments = parser.parse_args(list(argv))
    if options.all and arguments:
        parser.error("invalid arguments with kill all (-a) option")
    with GraphClient("rosnode") as graph:
        known = node_names(graph.master)
        if options.all:
            nodes = known
        elif arguments:
            nodes = [graph.resolve(name) for name in arguments]
        else:
            nodes = [_choose(known)]
        if unknown := [node for node in nodes if node not in known]:
            print(bullets("ERROR: Unknown node(s):", unknown), file=sys.stderr)
            return 1
        if len(nodes) > 1:
            print(bullets("killing:", nodes))
        elif nodes:
            print(f"killing {listed(nodes[0])}")
        _, failed = kill(graph.master, nodes)
    if failed:
        for node, reason in failed.items():
            print(f"ERROR: {listed(node)}: {reason}", file=sys.stderr)
        print(bullets("ERROR: Failed to kill:", list(failed)), file=sys.stderr)
        return 1
    print("killed")
    return 0


def _choose(nodes: Sequence[str]) -> str:
    """Ask the user to choose a node, and return it. Raise KeyboardInterrupt at the end of the input."""
    for number, node in enumerate(nodes, 1):
        print(f"{number}. {listed(node)}")
    print("\nPlease enter the number of the node you wish to kill.\n> ", end="", flush=True)
    for answer in sys.stdin:
        if answer.strip().isdecimal() and 1 <= int(answer) <= len(nodes):
            return nodes[int(answer) - 1]
        print("ERROR: please enter a number (ctrl-C to cancel)")
    raise KeyboardInterrupt
