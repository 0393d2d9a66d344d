"""`rosnode machine`: lists machines, or the nodes on a machine."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.printable import listed
from pipros_tools.cli.runner import option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.nodes import machines, nodes_on


def show_machines(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "machine [machine-name]")
    _, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("please enter only one machine name")
    with GraphClient("rosnode") as graph:
        lines = nodes_on(graph.master, arguments[0]) if arguments else machines(graph.master)
    print("\n".join(map(listed, lines)))
    return 0
