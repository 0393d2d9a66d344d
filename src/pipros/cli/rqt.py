"""Commands of the `rqt_graph` family: each opens the page at its tab."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from urllib.parse import quote

from pipros.cli.entry_point import command
from pipros.cli.page_command import page_parser, show, without_remappings
from pipros.cli.runner import run
from pipros.graph.client import GraphClient

Main = Callable[[Sequence[str] | None], int]


def _tool(name: str, tab: str, argument: str = "", *, most: int | None = 1) -> Main:
    """Return a command that opens a tab; it takes up to `most` arguments, called `argument` in its usage."""
    limit = most if argument else 0

    def body(argv: Sequence[str]) -> int:
        parser = page_parser(name, f"[options] {argument}".rstrip())
        options, words = parser.parse_args(without_remappings(argv))
        if limit is not None and len(words) > limit:
            parser.error(f"unexpected argument: {words[-1]}")
        with GraphClient(name) as graph:
            wanted = ",".join(_resolved(graph, word) for word in words)
        return show(name, f"{tab}/{quote(wanted, safe='')}" if wanted else tab, options)

    @command
    def main(argv: Sequence[str] | None = None) -> int:
        return run(lambda: body(sys.argv[1:] if argv is None else argv))

    main.__name__ = name
    return main


def _resolved(graph: GraphClient, word: str) -> str:
    """Resolve a topic, node or field to its global name; keep the index and nested fields."""
    end = min((at for at in map(word.find, ":[") if at >= 0), default=len(word))
    return graph.resolve(word[:end]) + word[end:]


rqt = _tool("rqt", "graph")
rqt_console = _tool("rqt_console", "console")
rqt_image_view = _tool("rqt_image_view", "images", "[topic]")
rqt_logger_level = _tool("rqt_logger_level", "console", "[node]")
rqt_plot = _tool("rqt_plot", "plot", "[/topic/field1:field2 ...]", most=None)
rqt_publisher = _tool("rqt_publisher", "publish", "[topic]")
rqt_reconfigure = _tool("rqt_reconfigure", "reconfigure", "[server]")
rqt_robot_monitor = _tool("rqt_robot_monitor", "diagnostics")
rqt_service_caller = _tool("rqt_service_caller", "services", "[service]")
rqt_tf_tree = _tool("rqt_tf_tree", "tf")
rqt_top = _tool("rqt_top", "nodes")
rqt_topic = _tool("rqt_topic", "topics", "[topic]")
