"""`pipros`: commands that Noetic lacks, and a list of all commands."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import pipros
from pipros.cli.command_map import command_map
from pipros.cli.entry_point import command
from pipros.cli.runner import USAGE_ERROR, dispatch, run

OVERVIEW = f"""\
pipros {pipros.__version__}: ROS 1 from pip. The commands of ROS keep their names: roscore, rostopic, …

Commands:
\tpipros doctor\tfind out why nodes do not talk to each other, and what to do about it
\tpipros fleet\tjoin masters over a network, and run its router
\tpipros foxglove\tserve the running system to Foxglove
\tpipros graph\tshow the running system in a browser (rqt_graph)
\tpipros ros2\tconnect the running system to ROS 2 nodes
\tpipros serve\tserve the page, rosbridge and Foxglove on one port
\tpipros clients\tlist the clients of pipros serve or pipros foxglove
\tpipros env\tprint what to evaluate instead of sourcing a setup file
\tpipros version\tprint the versions of pipros, Python and ROS
\tpipros stubs\twrite type stubs for the messages of packages, for editors

Type pipros <command> -h for more detailed usage, pipros --help for a map of all commands of ROS
"""

SUBCOMMANDS = {
    "clients": "pipros.cli.clients:main",
    "doctor": "pipros.cli.doctor:main",
    "env": "pipros.cli.show_env:main",
    "fleet": "pipros.cli.fleet:main",
    "foxglove": "pipros.cli.foxglove:main",
    "graph": "pipros.cli.rqt_graph:main",
    "ros2": "pipros.cli.ros2:main",
    "serve": "pipros.cli.serve:main",
    "stubs": "pipros.cli.stubs:main",
    "version": "pipros.cli.version:main",
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(pipros.__version__)
        return 0
    if arguments[:1] in (["--help"], ["-h"], ["help"]):
        print(command_map(SUBCOMMANDS))
        return 0
    return run(lambda: dispatch(SUBCOMMANDS, arguments, OVERVIEW, USAGE_ERROR if arguments else 0))
