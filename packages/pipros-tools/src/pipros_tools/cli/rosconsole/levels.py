"""`rosconsole list`, `get` and `set`: list a node's loggers, and print or set their levels."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.names import parse_arguments
from pipros.basics.printable import listed
from pipros_tools.cli.runner import option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.loggers import LEVELS, levels_of, set_level

NO_SUCH_NODE, NO_SUCH_LOGGER = 1, 2
"""Noetic's exit codes."""

_LEVELS_LINE = f" <level> must be one of [{', '.join(LEVELS)}]"


def list_loggers(argv: Sequence[str]) -> int:
    parser = option_parser("rosconsole", "list <node>")
    _, words = parser.parse_args(list(parse_arguments(argv).rest))
    if not words:
        parser.error("you must specify a node to list loggers")
    if len(words) > 1:
        parser.error("you may only specify one node to list")
    with GraphClient("rosconsole") as graph:
        levels = _levels(graph, words[0])
    if levels is None:
        return NO_SUCH_NODE
    print("\n".join(listed(logger) for logger in levels))
    return 0


def show_level(argv: Sequence[str]) -> int:
    parser = option_parser("rosconsole", "get <node> <logger>")
    _, words = parser.parse_args(list(parse_arguments(argv).rest))
    if len(words) < 2:
        parser.error("you must specify a node and a logger")
    node, logger = words[:2]
    with GraphClient("rosconsole") as graph:
        levels = _levels(graph, node)
    if levels is None:
        return NO_SUCH_NODE
    if logger not in levels:
        return _no_such_logger(node, logger)
    print(listed(levels[logger]))
    return 0


def change_level(argv: Sequence[str]) -> int:
    parser = option_parser("rosconsole", f"set <node> <logger> <level>\n\n{_LEVELS_LINE}")
    _, words = parser.parse_args(list(parse_arguments(argv).rest))
    if len(words) < 3:
        parser.error("you must specify a node, a logger and a level")
    node, logger, level = words[:3]
    with GraphClient("rosconsole") as graph:
        levels = _levels(graph, node)
        if levels is None:
            return NO_SUCH_NODE
        if logger not in levels:
            return _no_such_logger(node, logger)
        if level.lower() not in LEVELS:
            parser.error("invalid level")
        set_level(graph.master, graph.resolve(node), logger, level)
    return 0


def _levels(graph: GraphClient, node: str) -> dict[str, str] | None:
    """Return the levels of a node's loggers. If the node does not answer, print an error and return None."""
    try:
        return levels_of(graph.master, graph.resolve(node))
    except GraphError as error:
        _print_error(f"node '{listed(node)}' doesn't exist or doesn't support query: {error}")
        return None


def _no_such_logger(node: str, logger: str) -> int:
    _print_error(f"node {listed(node)} does not contain logger {listed(logger)}")
    return NO_SUCH_LOGGER


def _print_error(text: str) -> None:
    print(f"rosconsole: error: {text}", file=sys.stderr)
