"""`pipros`: subcommands for which Noetic has no command."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import pipros
from pipros.cli.program import USAGE_ERROR, dispatch, run
from pipros.cli.streams import command

OVERVIEW = f"""\
pipros {pipros.__version__}: ROS 1 from pip. ROS' own commands have their own names: roscore, rostopic, …

Commands:
\tpipros stubs\twrite type stubs for the messages of packages, for editors

Type pipros <command> -h for more detailed usage
"""

SUBCOMMANDS = {"stubs": "pipros.cli.stubs:main"}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(pipros.__version__)
        return 0
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR if arguments else 0))
