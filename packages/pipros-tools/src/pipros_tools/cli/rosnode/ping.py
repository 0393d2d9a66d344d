"""`rosnode ping`: checks whether a node answers, and measures the time until it answers."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser

from pipros.basics.errors import PiprosError
from pipros.basics.printable import listed
from pipros.net.master_client import MasterClient
from pipros_tools.cli.runner import add_flag, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.nodes import node_names
from pipros_tools.graph.ping import ping, ping_all


def ping_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "ping [options] <node>")
    add_flag(parser, "-a", "--all", help="ping all nodes")
    parser.add_option(
        "-c",
        dest="count",
        metavar="COUNT",
        type="int",
        help="number of pings to send. Not available with --all",
    )
    options, arguments = parser.parse_args(list(argv))
    with GraphClient("rosnode") as graph:
        if options.all:
            if arguments:
                parser.error(f"Invalid arguments '{', '.join(arguments)}' used with --all")
            if options.count:
                parser.error("-c may not be used with --all")
            ping_all(graph.master, print)
            return 0
        if not arguments:
            _refuse_without_node(parser, graph.master)
        if len(arguments) > 1:
            parser.error("you may only specify one input node")
        node = graph.resolve(arguments[0])
        print(f"rosnode: node is [{node}]")
        ping(graph.master, node, count=options.count, say=print)
    return 0


def _refuse_without_node(parser: OptionParser, master: MasterClient) -> None:
    try:
        nodes = node_names(master)
    except PiprosError:  # if there is no master, the list is empty
        nodes = []
    if nodes:
        choice = "\n".join(map(listed, nodes))
        parser.print_usage(sys.stderr)
        print(f"rosnode: error: Please enter a node to ping. Available nodes are:\n{choice}", file=sys.stderr)
    parser.error("Please enter a node to ping")
