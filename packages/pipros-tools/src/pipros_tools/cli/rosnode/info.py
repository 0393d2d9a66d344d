"""`rosnode info`: describes nodes."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli.runner import add_flag, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.node_info import report_node
from pipros_tools.graph.output import to_stderr


def show_info(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "info [options] node1 [node2...]")
    add_flag(
        parser,
        "-q",
        "--quiet",
        help="Prints only basic information such as pubs/subs and does not contact nodes"
        " for more information",
    )
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must specify at least one node name")
    status = 0
    with GraphClient("rosnode") as graph:
        for name in arguments:
            try:
                report_node(graph.master, graph.resolve(name), quiet=options.quiet)
            except GraphError as error:  # this node does not answer; the others may
                to_stderr(f"ERROR: {error}")
                status = 1
    return status
