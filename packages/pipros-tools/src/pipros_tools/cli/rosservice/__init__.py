"""`rosservice`: lists, describes and calls services."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, dispatch, run

OVERVIEW = """\
Commands:
\trosservice args\tprint service arguments
\trosservice call\tcall the service with the provided args
\trosservice find\tfind services by service type
\trosservice info\tprint information about service
\trosservice list\tlist active services
\trosservice type\tprint service type
\trosservice uri\tprint service ROSRPC uri

Type rosservice <command> -h for more detailed usage, e.g. 'rosservice call -h'
"""

ERROR = 2

SUBCOMMANDS = {
    "args": "pipros_tools.cli.rosservice.show:show_args",
    "call": "pipros_tools.cli.rosservice.call:call_service",
    "find": "pipros_tools.cli.rosservice.show:find_services",
    "info": "pipros_tools.cli.rosservice.show:show_info",
    "list": "pipros_tools.cli.rosservice.show:list_services",
    "node": "pipros_tools.cli.rosservice.show:show_node",
    "type": "pipros_tools.cli.rosservice.show:show_type",
    "uri": "pipros_tools.cli.rosservice.show:show_uri",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR), error_code=ERROR)
