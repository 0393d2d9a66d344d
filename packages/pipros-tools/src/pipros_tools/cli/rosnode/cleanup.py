"""`rosnode cleanup`: unregisters nodes that cannot be reached."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli.runner import option_parser
from pipros_tools.graph.cleanup import clean_up
from pipros_tools.graph.client import GraphClient


def clean_up_nodes(argv: Sequence[str]) -> int:
    option_parser("rosnode", "cleanup").parse_args(list(argv))
    with GraphClient("rosnode") as graph:
        clean_up(graph.master)
    return 0
