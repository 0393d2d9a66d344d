"""`rosnode`: lists, describes, pings and shuts down nodes."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, dispatch, run

OVERVIEW = """\
rosnode is a command-line tool for printing information about ROS Nodes.

Commands:
\trosnode ping\ttest connectivity to node
\trosnode list\tlist active nodes
\trosnode info\tprint information about node
\trosnode machine\tlist nodes running on a particular machine or list machines
\trosnode kill\tkill a running node
\trosnode cleanup\tpurge registration information of unreachable nodes

Type rosnode <command> -h for more detailed usage, e.g. 'rosnode ping -h'
"""

SUBCOMMANDS = {
    "list": "pipros_tools.cli.rosnode.listing:list_nodes",
    "info": "pipros_tools.cli.rosnode.info:show_info",
    "ping": "pipros_tools.cli.rosnode.ping:ping_nodes",
    "machine": "pipros_tools.cli.rosnode.machine:show_machines",
    "kill": "pipros_tools.cli.rosnode.kill:kill_nodes",
    "cleanup": "pipros_tools.cli.rosnode.cleanup:clean_up_nodes",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    code = 0 if arguments[:1] == ["--help"] else USAGE_ERROR
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, code))
