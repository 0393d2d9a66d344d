"""`rosconsole`: sets the logger levels of other nodes, and prints log messages."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, dispatch, run

OVERVIEW = """\
rosconsole is a command-line tool for configuring the logger level of ROS nodes.

Commands:
\trosconsole get\tdisplay level for a logger
\trosconsole list\tlist loggers for a node
\trosconsole set\tset level for a logger
\trosconsole echo\tprint logger messages

Type rosconsole <command> -h for more detailed usage, e.g. 'rosconsole list -h'
"""

SUBCOMMANDS = {
    "get": "pipros_tools.cli.rosconsole.levels:show_level",
    "list": "pipros_tools.cli.rosconsole.levels:list_loggers",
    "set": "pipros_tools.cli.rosconsole.levels:change_level",
    "echo": "pipros_tools.cli.rosconsole.echo:echo",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR))
