"""`pipros fleet`: joins masters over Zenoh, runs a router, and shows members, topics, rates and losses."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.errors import MissingExtra
from pipros_tools.cli.runner import USAGE_ERROR, CommandError, dispatch, run

OVERVIEW = """\
pipros fleet joins ROS masters over a network. Each master also shows the topics and services of the others.

Commands:
\tpipros fleet router\trun a router, to which the members connect
\tpipros fleet join\tjoin the master to a fleet
\tpipros fleet list\tlist the members
\tpipros fleet info\tprint what a member shares and accepts
\tpipros fleet top\tshow rates, losses and round trips
\tpipros fleet history\tlist and copy what a router recorded for a member
\tpipros fleet param\tread and set a member's parameters
\tpipros fleet check\tcheck a member's file
\tpipros fleet keys\tcreate, renew and revoke certificates

Type pipros fleet <command> -h for more detailed usage
"""

SUBCOMMANDS = {
    "check": "pipros_fleet.commands.check:main",
    "history": "pipros_fleet.commands.history:main",
    "info": "pipros_fleet.commands.show:info",
    "join": "pipros_fleet.commands.join:main",
    "keys": "pipros_fleet.commands.keys:main",
    "list": "pipros_fleet.commands.show:list_members",
    "param": "pipros_fleet.commands.param:main",
    "router": "pipros_fleet.commands.router:main",
    "top": "pipros_fleet.commands.show:top",
}


def main(argv: Sequence[str]) -> int:
    code = 0 if list(argv[:1]) in (["--help"], ["-h"]) else USAGE_ERROR
    return run(lambda: _dispatch(argv, code))


def _dispatch(argv: Sequence[str], code: int) -> int:
    try:
        return dispatch(SUBCOMMANDS, argv, OVERVIEW, code)
    except MissingExtra as error:
        raise CommandError(str(error)) from None
