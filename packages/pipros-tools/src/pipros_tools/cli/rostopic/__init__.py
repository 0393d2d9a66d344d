"""`rostopic`: prints and publishes messages on topics, and measures their rates."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.interrupts import accept_ctrl_c
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, dispatch, run

OVERVIEW = """\
rostopic is a command-line tool for printing information about ROS Topics.

Commands:
\trostopic bw\tdisplay bandwidth used by topic
\trostopic delay\tdisplay delay of topic from timestamp in header
\trostopic echo\tprint messages to screen
\trostopic find\tfind topics by type
\trostopic hz\tdisplay publishing rate of topic\x20\x20\x20\x20
\trostopic info\tprint information about active topic
\trostopic list\tlist active topics
\trostopic pub\tpublish data to topic
\trostopic type\tprint topic or field type

Type rostopic <command> -h for more detailed usage, e.g. 'rostopic echo -h'
"""


SUBCOMMANDS = {
    "list": "pipros_tools.cli.rostopic.listing:list_topics",
    "info": "pipros_tools.cli.rostopic.info:show_info",
    "type": "pipros_tools.cli.rostopic.info:show_type",
    "find": "pipros_tools.cli.rostopic.info:find_topics",
    "echo": "pipros_tools.cli.rostopic.echo:echo",
    "pub": "pipros_tools.cli.rostopic.pub:publish",
    "hz": "pipros_tools.cli.rostopic.hz:measure_rate",
    "bw": "pipros_tools.cli.rostopic.bw:measure_bandwidth",
    "delay": "pipros_tools.cli.rostopic.delay:measure_delay",
}

NODES = frozenset(("echo", "pub", "hz", "bw", "delay"))
"""Subcommands that run a node, and therefore end on SIGINT even if SIGINT was ignored when they were
started.
"""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run one subcommand. Remapping arguments (`a:=b`) are passed to the subcommand's node."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] and arguments[0] in NODES:
        accept_ctrl_c()
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR))
