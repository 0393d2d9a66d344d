"""`pipros serve`: serves the page, rosbridge and Foxglove on one port."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.plugins import offered
from pipros_bridges.commands.bridge_options import add_bridge_options, bridge_options, client_limits
from pipros_tools.cli.runner import option_parser, run
from pipros_tools.cli.server_options import bind_address, without_remappings

PORT = 9090


def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros serve", "[options]")
    add_bridge_options(parser, PORT)
    serve_tab = offered("tab")
    if serve_tab is not None:
        parser.add_option(
            "--tab",
            metavar="FOLDER",
            help="serve only the page for ROS in a browser tab (plugins/pipros-tab/docs/start/tab.md)",
        )
    options, arguments = parser.parse_args(without_remappings(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    if serve_tab is not None and options.tab is not None:
        host, port = bind_address(options.bind)
        port = options.port if port is None else port
        code: int = serve_tab(options.tab, host, port, options.cert, options.key)
        return code
    from pipros.node import Node
    from pipros_bridges.serve_all import serve_all

    node = Node("pipros_serve", anonymous=True, argv=argv, limits=client_limits(options))
    return serve_all(node, bridge_options("pipros serve", options))
