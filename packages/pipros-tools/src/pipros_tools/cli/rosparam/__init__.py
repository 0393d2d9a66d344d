"""`rosparam`: reads and writes the parameters of a running system."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import dispatch, run

OVERVIEW = """\
rosparam is a command-line tool for getting, setting, and deleting parameters from the ROS Parameter Server.

Commands:
\trosparam set\tset parameter
\trosparam get\tget parameter
\trosparam load\tload parameters from file
\trosparam dump\tdump parameters to file
\trosparam delete\tdelete parameter
\trosparam list\tlist parameter names
"""

SUBCOMMANDS = {
    "set": "pipros_tools.cli.rosparam.change:set_parameter",
    "get": "pipros_tools.cli.rosparam.show:get_parameter",
    "load": "pipros_tools.cli.rosparam.change:load_parameters",
    "dump": "pipros_tools.cli.rosparam.show:dump_parameters",
    "delete": "pipros_tools.cli.rosparam.change:delete_parameter",
    "list": "pipros_tools.cli.rosparam.show:list_parameters",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, 0))
