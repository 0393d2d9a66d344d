"""`rqt_graph`: the graph as a live page in a browser, or as a picture."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.cli.program import CommandError, option_parser, run
from pipros.cli.streams import command

if TYPE_CHECKING:
    from pipros.graph.drawing.node_graph import NodeGraph


@command
def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    parser = page_parser("rqt_graph", "[options]")
    parser.add_option("--dot", action="store_true", help="print the graph for Graphviz and end")
    parser.add_option("--svg", metavar="FILE", help="write the graph as SVG and end")
    parser.add_option("--png", metavar="FILE", help="write the graph as PNG and end (needs Pillow)")
    parser.add_option(
        "--mode",
        default="active",
        help="nodes: nodes only; active (default): nodes and topics that are connected; all: all topics",
    )
    parser.add_option(
        "--all", action="store_true", help="hide nothing, such as /rosout and the nodes of tools"
    )
    options, arguments = parser.parse_args(list(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    if options.mode not in ("nodes", "active", "all"):
        parser.error(f"--mode must be nodes, active or all, got {options.mode}")
    if options.dot or options.svg or options.png:
        return _write_pictures(options)
    return show("rqt_graph", "graph", options)


def page_parser(name: str, usage: str) -> OptionParser:
    """The options that all commands of the page have."""
    parser = option_parser(name, usage)
    parser.add_option("--bind", metavar="HOST[:PORT]", default="127.0.0.1", help="where to listen (loopback)")
    parser.add_option("--cert", metavar="FILE", help="a certificate: serve the page with TLS")
    parser.add_option("--key", metavar="FILE", help="its private key, when it is not in the same file")
    parser.add_option("--control", action="store_true", help="let the page change the system")
    parser.add_option("--no-browser", action="store_true", help="print the address only")
    return parser


def show(tool: str, tab: str, options: Any) -> int:
    """Serves the page, opened at a tab, until Ctrl-C."""
    from pipros.web.program import PageOptions, serve_page

    host, port = _bind_address(options.bind)
    return serve_page(
        PageOptions(
            tool,
            tab,
            host,
            port,
            options.cert,
            options.key,
            has_control=bool(options.control),
            opens_browser=not options.no_browser,
        )
    )


def _bind_address(text: str) -> tuple[str, int]:
    """Host and port of `HOST`, `HOST:PORT` and `[IPV6]:PORT`."""
    host, colon, port = text.rpartition(":")
    if not colon or (":" in host and not host.startswith("[")) or text.endswith("]"):
        return text, 0
    if not port.isdigit() or int(port) > 65535:
        raise CommandError(f"--bind must be HOST or HOST:PORT with a port from 0 to 65535, got {text}")
    return host, int(port)


def _write_pictures(options: Any) -> int:
    from pipros.graph.drawing.dot import to_dot
    from pipros.graph.drawing.png import to_png
    from pipros.graph.drawing.scene import draw
    from pipros.graph.drawing.svg import to_svg

    graph = _graph_now(options)
    if options.dot:
        print(to_dot(graph), end="")
    scene = draw(graph)
    if options.svg:
        _write(options.svg, to_svg(scene).encode())
    if options.png:
        _write(options.png, to_png(scene))
    return 0


def _graph_now(options: Any) -> NodeGraph:
    from pipros.graph.client import GraphClient
    from pipros.graph.drawing.node_graph import GraphOptions, node_graph
    from pipros.graph.observer import Observer

    hides = not options.all
    shown = GraphOptions(options.mode, hide_dead_sinks=hides, hide_leaf_topics=hides, hide_debug=hides)
    with GraphClient("rqt_graph") as client:
        client.master.get_pid()
        observer = Observer(client.master)
        try:
            found = observer.look()
        finally:
            observer.close()
    return node_graph(found.state, found.connections, found.unreachable, shown)


def _write(name: str, content: bytes) -> None:
    try:
        Path(name).write_bytes(content)
    except OSError as error:
        raise CommandError(f"cannot write {name}: {error.strerror}") from None
