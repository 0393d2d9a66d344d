"""`roscore`: runs a master, a parameter server and the `/rosout` node in one process."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.roslaunch import run
from pipros_tools.cli.roslaunch_options import add_core_options, session_options
from pipros_tools.launch.console import Console
from pipros_tools.launch.session import LaunchSession


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the core until Ctrl-C; return the exit code."""
    parser = OptionParser(
        usage="usage: %prog [options]",
        prog="roscore",
        description="roscore will start up a ROS Master, a ROS Parameter Server and a rosout logging node",
        epilog="See http://wiki.ros.org/roscore",
    )
    add_core_options(parser)
    parser.add_option(
        "--bind",
        metavar="ADDRESS",
        help="address to listen on: 0.0.0.0 opens the master to the network. By default, only this "
        "computer can connect, unless ROS_HOSTNAME, ROS_IP or, if neither is set, ROS_MASTER_URI names an "
        "address that is not loopback.",
    )
    parser.add_option(
        "--allow",
        metavar="NETWORK",
        action="append",
        help="network that may connect when the master is open, such as 10.0.0.0/8; may be repeated. "
        "By default, all networks may connect.",
    )
    parser.add_option(
        "--resume",
        action="store_true",
        default=False,
        help="restore this master's last parameters, and the registrations of nodes that are still running",
    )
    parser.set_defaults(
        core=True,
        run_id=None,
        wait=False,
        no_summary=False,
        skip_log_check=False,
        force_screen=False,
        force_log=False,
        force_required=False,
        local_only=False,
        child_name=None,
    )
    options, words = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    words = [word for word in words if ":=" not in word]
    if words:
        parser.error("roscore does not take arguments")
    from pipros.master.master import tune_for_master

    tune_for_master()
    console = Console(is_verbose=options.verbose)
    return run(lambda: LaunchSession([], {}, session_options(options), console), console, options)


if __name__ == "__main__":
    sys.exit(main())
