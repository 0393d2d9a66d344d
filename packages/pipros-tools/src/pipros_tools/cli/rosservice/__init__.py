"""`rosservice`: lists, describes and calls services."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.cli.entry_point import command
from pipros.cli.runner import USAGE_ERROR, dispatch, run

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
    "args": "pipros.cli.rosservice.show:show_args",
    "call": "pipros.cli.rosservice.call:call_service",
    "find": "pipros.cli.rosservice.show:find_services",
    "info": "pipros.cli.rosservice.show:show_info",
    "list": "pipros.cli.rosservice.show:list_services",
    "node": "pipros.cli.rosservice.show:show_node",
    "type": "pipros.cli.rosservice.show:show_type",
    "uri": "pipros.cli.rosservice.show:show_uri",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR), error_code=ERROR)
