"""`pipros fleet join`: joins a master to a fleet."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_fleet.commands.options import ROUTER, add_link_options, tls_of
from pipros_tools.cli.runner import option_parser
from pipros_tools.cli.server_options import without_remappings


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet join", "NAME [options]")
    add_link_options(parser)
    parser.add_option("--file", metavar="FILE", help="what to share and accept; see `pipros fleet check`")
    options, arguments = parser.parse_args(without_remappings(argv))
    if len(arguments) != 1:
        parser.error("exactly one member name is required")
    from pipros_fleet.fleet_file import read_fleet_file
    from pipros_fleet.fleet_rules import FleetFile
    from pipros_fleet.keys import member_name
    from pipros_fleet.serve import agent_node, serve_member

    name = member_name(arguments[0])
    file = read_fleet_file(options.file) if options.file else FleetFile()
    router = options.router or file.router or ROUTER
    return serve_member(agent_node(name, argv), name, router, file, tls_of(options, router))
