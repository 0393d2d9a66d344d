"""Options of roslaunch and roscore, and their conversion to session options."""

from __future__ import annotations

import os
from functools import partial
from optparse import OptionParser, Values
from pathlib import Path
from typing import TYPE_CHECKING

from pipros_tools.cli.runner import add_flag
from pipros_tools.launch.model import Output

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipros_tools.launch.run_options import RunOptions
    from pipros_tools.launch.session import SessionOptions

USAGE = (
    "usage: %prog [options] [package] <filename> [arg_name:=value...]\n"
    "       %prog [options] <filename> [<filename>...] [arg_name:=value...]\n\n"
    "If <filename> is a single dash ('-'), launch XML is read from standard input."
)


def make_parser() -> OptionParser:
    """Return a parser with all options of genuine `roslaunch --help`, and pipros's own options."""
    parser = OptionParser(usage=USAGE, prog="roslaunch")
    add, flag = parser.add_option, partial(add_flag, parser)
    files = "Print list files loaded by launch file, including launch file itself"
    flag("--files", dest="file_list", help=files)
    add("--args", dest="node_args", metavar="NODE_NAME", help="Print command-line arguments for node")
    flag("--nodes", dest="node_list", help="Print list of node names in launch file")
    add("--find-node", metavar="NODE_NAME", help="Find launch file that node is defined in")
    child = "Run as child service 'NAME'. Required with -u"
    add("-c", "--child", dest="child_name", metavar="NAME", help=child)
    flag("--local", dest="local_only", help="Do not launch remote nodes")
    flag("--screen", dest="force_screen", help="Force output of all local nodes to screen")
    flag("--required", dest="force_required", help="Force all nodes to be required")
    flag("--log", dest="force_log", help="Force output of all local nodes to log")
    add("-u", "--server_uri", metavar="URI", help="URI of server. Required with -c")
    add("--run_id", metavar="RUN_ID", help="run_id of session. Required with -c")
    flag("--wait", help="wait for master to start before launching")
    flag("--core", help="Launch core services only")
    add_core_options(parser)
    flag("--no-summary", help="hide summary printing")
    flag("--dump-params", help="Dump parameters of all roslaunch files to stdout")
    flag("--skip-log-check", help="skip check size of log folder")
    flag("--ros-args", help="Display command-line arguments for this launch file")
    flag("--disable-title", help="Disable setting of terminal title")
    flag("--dry-run", help="Print what would be set and started, and start nothing")
    raw_output = "Let nodes write to the terminal themselves, without their names before each line"
    flag("--raw-output", help=raw_output)
    return parser


def add_core_options(parser: OptionParser) -> None:
    """Add the options shared by roslaunch and roscore."""
    add = parser.add_option
    add(
        "-p",
        "--port",
        dest="port",
        type="int",
        metavar="PORT",
        help="master port. Only valid if master is launched",
    )
    add("--ports", metavar="FIRST-LAST", help="port range for pipros nodes, like PIPROS_PORTS")
    add("--pid", dest="pid_fn", metavar="PID_FN", default="", help="write the roslaunch pid to filename")
    add("-v", dest="verbose", action="store_true", default=False, help="verbose printing")
    add(
        "-w",
        "--numworkers",
        dest="num_workers",
        type="int",
        metavar="NUM_WORKERS",
        help="override number of worker threads. Only valid for core services.",
    )
    add(
        "-t",
        "--timeout",
        dest="timeout",
        type="float",
        metavar="TIMEOUT",
        help="override the socket connection timeout (in seconds). Only valid for core services.",
    )
    add(
        "--master-logger-level",
        dest="master_logger_level",
        metavar="MASTER_LOGGER_LEVEL",
        help="set rosmaster.master logger level ('debug', 'info', 'warn', 'error', 'fatal')",
    )
    add(
        "--sigint-timeout",
        dest="sigint_timeout",
        type="float",
        metavar="SIGINT_TIMEOUT",
        help="the SIGINT timeout used when killing nodes (in seconds).",
    )
    add(
        "--sigterm-timeout",
        dest="sigterm_timeout",
        type="float",
        metavar="SIGTERM_TIMEOUT",
        help="the SIGTERM timeout used when killing nodes if SIGINT does not stop the node (in seconds).",
    )


def check_child_options(parser: OptionParser, options: Values, words: Sequence[str]) -> None:
    """Exit with an error if an option required by `--child` is missing, or if a file is given."""
    if not options.server_uri:
        parser.error("--child option requires --server_uri to be set as well")
    if not options.run_id:
        parser.error("--child option requires --run_id to be set as well")
    if words:
        parser.error("Input files are not allowed when run in child mode")


def check_combination(parser: OptionParser, options: Values, words: Sequence[str]) -> None:
    """Exit with an error if a file is missing or, with `--core`, given, or if two options print something."""
    if options.core and words:
        parser.error("Input files are not allowed when launching core")
    if not words and not options.core:
        parser.error("you must specify at least one input file")
    if sum(map(bool, (options.node_list, options.find_node, options.node_args, options.ros_args))) > 1:
        parser.error("only one of [--nodes, --find-node, --args --ros-args] may be specified")


def session_options(options: Values) -> SessionOptions:
    """Convert the command-line options of roslaunch or roscore to session options.

    `--ports` sets `PIPROS_PORTS` in the environment of this process.

    Raises:
        InvalidEnvironment: `--ports` is not a range of ports.
        LaunchError: the port is not between 0 and 65535, or the timeout of a stop signal is not positive.
    """
    from pipros.basics.ports import PORTS, PortRange
    from pipros.master.options import MasterOptions, limits_with_timeout
    from pipros_tools.launch.model import LaunchError
    from pipros_tools.launch.session import SessionOptions

    if options.ports:
        PortRange.parse(options.ports, "--ports")
        os.environ[PORTS] = options.ports  # for this process and its nodes
    if options.port is not None and not 0 <= options.port <= 65535:
        raise LaunchError(f"port must be between 0 and 65535, got {options.port}")
    return SessionOptions(
        is_core=options.core,
        port=options.port,
        master=MasterOptions(
            host=getattr(options, "bind", None),
            allow=tuple(getattr(options, "allow", None) or ()),
            store=_store(options),
            limits=limits_with_timeout(options.timeout),
            log_level=options.master_logger_level,
        ),
        run_id=options.run_id,
        has_summary=not options.no_summary,
        checks_log_folder=not options.skip_log_check,
        run=run_options(options),
    )


def run_options(options: Values) -> RunOptions:
    """Convert the command-line options to options for running nodes.

    Raises:
        LaunchError: the timeout of a stop signal is not positive.
    """
    from pipros_tools.launch import output_prefix
    from pipros_tools.launch.run_options import RunOptions
    from pipros_tools.launch.terminate import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S

    sigint, sigterm = options.sigint_timeout, options.sigterm_timeout
    return RunOptions(
        output=Output.SCREEN if options.force_screen else Output.LOG if options.force_log else None,
        all_required=options.force_required,
        local_only=options.local_only,
        has_prefixes=not getattr(options, "raw_output", True) and output_prefix.is_available(),
        is_child=bool(options.child_name),
        sigint_timeout_s=SIGINT_TIMEOUT_S if sigint is None else sigint,
        sigterm_timeout_s=SIGTERM_TIMEOUT_S if sigterm is None else sigterm,
    )


def _store(options: Values) -> Path | None:
    """Return the file in which `roscore --resume` stores parameters and registrations, one file per port.

    Return None if `--resume` is not given.
    """
    if not getattr(options, "resume", False):
        return None
    from pipros.basics.env import DEFAULT_MASTER_PORT, Environment

    home = Environment.from_os().ros_home
    return home / "pipros" / f"master-{options.port or DEFAULT_MASTER_PORT}.sqlite"
