"""`rqt_graph`: shows the graph as a live page in a browser, or writes it as an image."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.replaced_file import write_whole
from pipros_page.commands.page_command import page_parser, show
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, add_flag, run
from pipros_tools.cli.server_options import without_remappings

if TYPE_CHECKING:
    from pipros_tools.graph.drawing.node_graph import NodeGraph


@command
def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    parser = page_parser("rqt_graph", "[options]")
    add_flag(parser, "--dot", help="print the graph for Graphviz and exit")
    parser.add_option("--svg", metavar="FILE", help="write the graph as SVG and exit")
    parser.add_option("--png", metavar="FILE", help="write the graph as PNG and exit (needs Pillow)")
    parser.add_option(
        "--mode",
        default="active",
        help="nodes: nodes only; active (default): nodes and topics that are connected; all: all topics",
    )
    add_flag(parser, "--all", help="hide nothing, not even /rosout and the nodes of tools")
    options, arguments = parser.parse_args(without_remappings(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    if options.mode not in ("nodes", "active", "all"):
        parser.error(f"--mode must be nodes, active or all, got {options.mode}")
    if options.dot or (options.svg, options.png) != (None, None):
        return _write_pictures(options)
    return show("rqt_graph", "graph", options)


def _write_pictures(options: Any) -> int:
    from pipros_tools.graph.drawing.dot import to_dot
    from pipros_tools.graph.drawing.png import to_png
    from pipros_tools.graph.drawing.scene import draw
    from pipros_tools.graph.drawing.svg import to_svg

    graph = _graph_now(options)
    if options.dot:
        print(to_dot(graph), end="")
    scene = draw(graph)
    if options.svg is not None:
        _write(options.svg, to_svg(scene).encode())
    if options.png is not None:
        _write(options.png, to_png(scene))
    return 0


def _graph_now(options: Any) -> NodeGraph:
    from pipros_tools.graph.client import GraphClient
    from pipros_tools.graph.drawing.node_graph import GraphOptions, node_graph
    from pipros_tools.graph.observer import SystemObserver

    hides = not options.all
    shown = GraphOptions(options.mode, hide_dead_sinks=hides, hide_leaf_topics=hides, hide_debug=hides)
    with GraphClient("rqt_graph") as client:
        client.master.get_pid()
        found = SystemObserver(client.master).poll()
    return node_graph(found.state, found.connections, found.unreachable, shown)


def _write(name: str, content: bytes) -> None:
    try:
        write_whole(Path(name), content)
    except OSError as error:
        raise CommandError(f"cannot write {name}: {error.strerror}") from None
